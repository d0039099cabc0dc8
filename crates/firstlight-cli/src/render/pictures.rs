//! The pictures of one scene: every frame, from every side, in every size.

use crate::args::{Frames, NamedView, Size};
use crate::output::{Part, Several, ViewName};

/// Which pictures are made of each scene.
#[derive(Clone, Debug)]
pub(super) struct Pictures {
    pub frames: Option<Frames>,
    pub views: Views,
    /// None or one: there is one size, and names need not say it.
    pub sizes: Vec<Size>,
}

/// From where a scene is seen.
#[derive(Clone, Debug)]
pub(super) enum Views {
    /// From one side.
    One,
    Named(Vec<NamedView>),
    /// From so many places around it.
    Turntable(u32),
}

impl Views {
    fn count(&self) -> u64 {
        match self {
            Views::One => 1,
            Views::Named(views) => views.len() as u64,
            Views::Turntable(count) => u64::from(*count),
        }
    }
}

/// One of the pictures of a scene.
pub(super) struct Picture {
    /// Which of them it is, from 0 on.
    pub index: u64,
    /// What tells its files from those of the others.
    pub part: Part,
    /// Which of the sizes.
    pub size: usize,
    /// Which of the views.
    pub view: usize,
}

impl Pictures {
    pub fn count(&self) -> u64 {
        self.frames() * self.views.count() * self.size_count()
    }

    fn frames(&self) -> u64 {
        self.frames.map_or(1, |Frames { first, last }| u64::from(last - first) + 1)
    }

    fn size_count(&self) -> u64 {
        self.sizes.len().max(1) as u64
    }

    /// Frame by frame, in each view by view, in each size by size: what is dear to make anew changes least often.
    pub fn iter(&self) -> impl Iterator<Item = Picture> + Clone {
        (0..self.count()).map(|index| self.get(index))
    }

    fn get(&self, index: u64) -> Picture {
        let size = (index % self.size_count()) as usize;
        let view = (index / self.size_count() % self.views.count()) as usize;
        let frame = index / self.size_count() / self.views.count();
        let part = Part {
            frame: self.frames.map(|frames| frames.first + frame as u32),
            view: match &self.views {
                Views::One => None,
                Views::Named(views) => Some(ViewName::Word(views[view].name.to_owned())),
                Views::Turntable(_) => Some(ViewName::Turn(view as u32)),
            },
            size: (self.sizes.len() > 1).then(|| self.sizes[size].to_string()),
        };
        Picture { index, part, size, view }
    }

    /// Which of them the names of files have to tell apart.
    pub fn several(&self) -> Several {
        Several { views: !matches!(self.views, Views::One), sizes: self.sizes.len() > 1 }
    }

    /// The options that ask for more than one, for messages.
    pub fn option(&self) -> Option<&'static str> {
        match self.views {
            _ if self.frames.is_some() => Some("--frames"),
            Views::Named(_) => Some("--views"),
            Views::Turntable(_) => Some("--turntable"),
            Views::One if self.sizes.len() > 1 => Some("--size"),
            Views::One => None,
        }
    }

    /// What messages call several of them.
    pub fn word(&self) -> &'static str {
        if self.frames.is_some() && self.frames() == self.count() { "frames" } else { "pictures" }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_picture_comes_once() {
        let front = NamedView { name: "front", view: firstlight::View::new(0.0, 0.0) };
        let pictures = Pictures {
            frames: Some(Frames { first: 3, last: 4 }),
            views: Views::Named(vec![front, NamedView { name: "top", ..front }]),
            sizes: vec![Size::Longer(8), Size::Both(4, 2)],
        };
        let all: Vec<_> = pictures.iter().map(|picture| picture.part).collect();
        assert_eq!((all.len() as u64, pictures.count()), (8, 8));
        let part = |frame, view: &str, size: &str| Part {
            frame: Some(frame),
            view: Some(ViewName::Word(view.into())),
            size: Some(size.into()),
        };
        assert_eq!(all[..3], [part(3, "front", "8"), part(3, "front", "4x2"), part(3, "top", "8")]);
        assert_eq!(all[7], part(4, "top", "4x2"));
        // One picture needs no name
        let one = Pictures { frames: None, views: Views::One, sizes: vec![Size::Longer(8)] };
        assert_eq!(one.iter().map(|picture| picture.part).collect::<Vec<_>>(), [Part::default()]);
    }
}
