"""Data sets in COCO's format."""

import os

from ._firstlight import CocoBase, Render

_IDS = "object-id"


class Coco(CocoBase):
    """A data set in COCO's format, which grows picture by picture: boxes and masks of the objects that are seen.

    Each annotation has the mask of what is seen of an object, as compressed run lengths, its box and its area, and the
    same of the object alone, with nothing before it. Categories are the names of objects, of `room/chair` the last
    part; pictures of one scene have the same.
    """

    def add(self, picture, file_name, *, only=None, **options):
        """Adds a picture with the objects that the middles of its pixels meet; a scene is rendered for it.

        Parameters
        ----------
        picture : Render or Scene
            A render with the buffer `object-id`, or a scene, which is rendered.
        file_name : path-like
            What the data set calls the picture's file. No file is written: `Render.save` does that.
        only : str or list of str, optional
            The objects to annotate, by their names or by those of categories; nothing else is a category then. Without
            it, all shapes; lights only if they are named here.
        **options
            What `Scene.render` takes, if `picture` is a scene; `object-id` is rendered in any case.

        Returns
        -------
        Render

        Raises
        ------
        ValueError
            No object is called so; the render has no `object-id`, or was pickled and has lost its scene.
        """
        if isinstance(picture, Render):
            if options:
                raise TypeError(f"{', '.join(options)}: the picture is rendered already; they are for a scene")
        elif hasattr(picture, "render"):
            buffers = options.pop("buffers", None)
            if buffers is None:
                buffers = picture.settings.fields.get("buffers", ["color"])
            buffers = [buffers] if isinstance(buffers, str) else list(buffers)
            picture = picture.render(buffers=buffers + [_IDS] * (_IDS not in buffers), **options)
        else:
            raise TypeError(f"a Render or a Scene is wanted, not {type(picture).__name__}")
        self._add(picture, os.fspath(file_name), [only] if isinstance(only, str) else only)
        return picture

    def __repr__(self):
        images, annotations, categories = self._counts()
        return f"<firstlight.Coco: {images} pictures, {annotations} annotations, {categories} categories>"
