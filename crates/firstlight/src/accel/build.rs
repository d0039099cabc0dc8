//! Building the tree: the surface area heuristic over binned centroids, then eight boxes to a node.
//!
//! Each range of primitives is cut in two where the surface area heuristic says it is cheapest (Wald 2007, "On fast
//! construction of SAH-based bounding volume hierarchies"), until a leaf can hold what is left; then the binary tree is
//! gathered into nodes of eight by opening the largest box first (Wald, Benthin and Boulos 2008).
//!
//! It replaces `obvhs`, whose medium preset needs 48 bytes for each of its 2 n nodes, twice while it builds, besides 64
//! bytes of boxes and sort keys for each primitive: more than 2.5 GB for ten million triangles. Here a primitive takes
//! 32 bytes and is sorted in place.
//!
//! The tree is the same for every number of threads: where it is cut into tasks depends on the number of primitives
//! alone, bins are joined by minimum, maximum and whole numbers, and the tasks' results are joined in their order.

use glam::{BVec4A, UVec4, Vec4, Vec4Swizzles};

use super::Aabb;
use super::node::{BoxNode, LEAF, Tree, WIDTH};
use crate::math::Vec3;
use crate::parallel::{self, CHUNK};

/// The most bins along an axis.
const BINS: usize = 32;
/// Primitives below which a range is one task.
const MIN_TASK: usize = 2048;
/// Tasks a large build is cut into, about.
const TASKS: usize = 128;
/// Primitives from which a range is binned by several threads.
const PARALLEL: usize = 1 << 16;
/// Binary levels after which ranges are halved by count: bounds the recursion whatever the boxes.
const MAX_DEPTH: usize = 96;
/// Adding it leaves a small number's nearest integer in the lowest bits.
const ROUNDER: f32 = 8_388_608.0;

/// A primitive while the tree is built: its box, relative to the centre, and its id in the bits of `lo.w`.
#[derive(Clone, Copy, Default)]
struct Prim {
    lo: Vec4,
    hi: Vec4,
}

impl Prim {
    fn id(&self) -> u32 {
        self.lo.w.to_bits()
    }

    /// Twice the middle of the box.
    #[inline(always)]
    fn center(&self) -> Vec4 {
        self.lo + self.hi
    }
}

/// A box that grows.
#[derive(Clone, Copy)]
struct Bounds {
    lo: Vec4,
    hi: Vec4,
}

impl Bounds {
    const EMPTY: Bounds = Bounds { lo: Vec4::INFINITY, hi: Vec4::NEG_INFINITY };

    #[inline(always)]
    fn add(&mut self, lo: Vec4, hi: Vec4) {
        self.lo = self.lo.min(lo);
        self.hi = self.hi.max(hi);
    }

    #[inline(always)]
    fn join(mut self, other: Bounds) -> Bounds {
        self.add(other.lo, other.hi);
        self
    }

    /// Half the surface.
    #[inline(always)]
    fn area(&self) -> f32 {
        let d = (self.hi - self.lo).xyz();
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// A node of the binary tree: a box, and either a run of primitives or two nodes, one right after this and `second`.
#[derive(Clone, Copy)]
struct BinaryNode {
    bounds: Bounds,
    /// The first primitive of a leaf, or the second child.
    first: u32,
    /// Primitives of a leaf; 0 in an inner node.
    count: u32,
}

/// A finished part of the tree, its indices counted from its own beginning.
struct Part {
    bounds: Bounds,
    nodes: Vec<BoxNode>,
    leaves: Vec<LeafRange>,
    /// A node or leaf of this part.
    root: u32,
    stack: usize,
}

/// The binary tree above the parts.
enum Top {
    Split(Box<[Top; 2]>, Bounds),
    Part(Part),
}

impl Top {
    fn bounds(&self) -> Bounds {
        match self {
            Top::Split(_, bounds) => *bounds,
            Top::Part(part) => part.bounds,
        }
    }
}

/// A run of the order of primitives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LeafRange {
    pub first: u32,
    pub count: u32,
}

/// A tree, the order of primitives its leaves are runs of, and these runs.
pub(crate) struct Built {
    pub tree: Tree,
    pub order: Vec<u32>,
    pub leaves: Vec<LeafRange>,
}

/// Builds the tree over those of `count` boxes that are sound, with at most 2 to the power of `leaf_bits` of them in a
/// leaf.
///
/// `key`: things of the same key are the same to every ray, and only that of the lowest id need be in a leaf. It is
/// asked where more boxes than a leaf holds have one centre, which no tree can part: ten thousand copies of a triangle
/// would all be asked by every ray that comes near.
pub(crate) fn build<K: Ord>(
    count: usize,
    boxes: impl Fn(usize) -> Aabb + Sync,
    leaf_bits: u32,
    key: impl Fn(u32) -> K + Sync,
) -> Built {
    assert!(count < LEAF as usize, "ids fit 31 bits");
    // Collect the primitives, and find the middle of all
    let prim = |i: usize| {
        let Aabb { min, max } = boxes(i);
        Prim { lo: min.extend(f32::from_bits(i as u32)), hi: max.extend(0.0) }
    };
    let is_sound = |prim: &Prim| Aabb { min: prim.lo.xyz(), max: prim.hi.xyz() }.is_sound();
    let mut prims: Vec<Prim> = parallel::map(count, CHUNK, prim);
    if !parallel::all(prims.len(), CHUNK, |i| is_sound(&prims[i])) {
        prims.retain(is_sound);
    }
    if prims.is_empty() {
        let tree = Tree { nodes: Vec::new(), center: Vec3::ZERO, half: 0.0, bounds: Aabb::EMPTY, stack: 0 };
        return Built { tree, order: Vec::new(), leaves: Vec::new() };
    }
    let all = join_chunks(&prims, bounds_of);
    let bounds = Aabb { min: all.lo.xyz(), max: all.hi.xyz() };
    let center = (bounds.min + bounds.max) * 0.5;
    // See them from there
    let away = center.extend(0.0);
    parallel::for_each_chunk(&mut prims, CHUNK, |_, prims| {
        for prim in prims {
            let id = prim.lo.w;
            (prim.lo, prim.hi) = (prim.lo - away, prim.hi - away);
            prim.lo.w = id;
        }
    });
    let centers = join_chunks(&prims, centers_of);
    // Cut and gather, in tasks
    let distinct = |prims: &mut [Prim]| distinct(prims, &key);
    let task = (prims.len() / TASKS).max(MIN_TASK);
    let settings = Settings { leaf: 1 << leaf_bits, leaf_bits, task, distinct: &distinct };
    let top = settings.top(&mut prims, centers, 0, 0);
    let order: Vec<u32> = parallel::map(prims.len(), CHUNK, |i| prims[i].id());
    drop(prims);
    // Join what the tasks made
    let (mut nodes_count, mut leaves_count) = (0, 0);
    top.count(&mut nodes_count, &mut leaves_count);
    let mut join =
        Join { nodes: Vec::with_capacity(nodes_count + TASKS * 4), leaves: Vec::with_capacity(leaves_count) };
    let all = top.bounds();
    let (root, mut stack) = join.take(top);
    if root & LEAF != 0 {
        let mut node = BoxNode::EMPTY;
        node.set(0, all.lo.xyz().to_array(), all.hi.xyz().to_array(), root);
        join.nodes.push(node);
        stack = 1;
    }
    join.nodes.shrink_to_fit();
    let half = (bounds.max - center).max(center - bounds.min).max_element();
    Built { tree: Tree { nodes: join.nodes, center, half, bounds, stack }, order, leaves: join.leaves }
}

/// Brings to the front the lowest id of each key, in their order, and says how many they are; leaves the rest behind
/// them.
fn distinct<K: Ord>(prims: &mut [Prim], key: &impl Fn(u32) -> K) -> usize {
    let mut keyed: Vec<(K, Prim)> = prims.iter().map(|prim| (key(prim.id()), *prim)).collect();
    keyed.sort_unstable_by(|(a, p), (b, q)| a.cmp(b).then(p.id().cmp(&q.id())));
    let is_first = |i: usize| i == 0 || keyed[i].0 != keyed[i - 1].0;
    let count = (0..keyed.len()).filter(|i| is_first(*i)).count();
    // Where none is twice all stay where they are
    if count < prims.len() {
        let (mut first, mut rest) = (0, count);
        for (i, (_, prim)) in keyed.iter().enumerate() {
            let place = if is_first(i) { &mut first } else { &mut rest };
            prims[*place] = *prim;
            *place += 1;
        }
    }
    count
}

/// What a build is told.
#[derive(Clone, Copy)]
struct Settings<'a> {
    /// The most primitives in a leaf.
    leaf: usize,
    /// The same, as a power of two.
    leaf_bits: u32,
    /// The most primitives in a task.
    task: usize,
    /// Parts primitives of one centre from their copies.
    distinct: &'a (dyn Fn(&mut [Prim]) -> usize + Sync),
}

/// Where and how to cut: the bin of each primitive, and the first bin that goes to the right.
#[derive(Clone, Copy)]
struct Partition {
    binning: Binning,
    axis: usize,
    bin: u32,
}

/// From centres to bins.
#[derive(Clone, Copy)]
struct Binning {
    lo: Vec4,
    scale: Vec4,
    bins: usize,
}

impl Binning {
    fn new(centers: Bounds, count: usize) -> Self {
        let bins = (4 + count / 8).min(BINS);
        let extent = centers.hi - centers.lo;
        let scale = |extent: f32| {
            let scale = (bins - 1) as f32 / extent;
            // Flat, or so thin or wide that the quotient means nothing: all in one bin
            if scale.is_finite() { scale } else { 0.0 }
        };
        Binning { lo: centers.lo, scale: Vec4::new(scale(extent.x), scale(extent.y), scale(extent.z), 0.0), bins }
    }

    /// The bins along the three axes.
    #[inline(always)]
    fn of(&self, prim: &Prim) -> UVec4 {
        let v = (prim.center() - self.lo) * self.scale + ROUNDER;
        UVec4::new(v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), 0) & (BINS as u32 - 1)
    }
}

/// The boxes and numbers of what fell into each bin.
#[derive(Clone)]
struct Bins {
    bounds: [[Bounds; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl Bins {
    fn of(prims: &[Prim], binning: &Binning) -> Self {
        let mut bins = Bins { bounds: [[Bounds::EMPTY; BINS]; 3], counts: [[0; BINS]; 3] };
        bins.fill(prims, binning);
        bins
    }

    fn clear(&mut self, bins: usize) {
        for axis in 0..3 {
            self.bounds[axis][..bins].fill(Bounds::EMPTY);
            self.counts[axis][..bins].fill(0);
        }
    }

    fn fill(&mut self, prims: &[Prim], binning: &Binning) {
        for prim in prims {
            let bin = binning.of(prim);
            for (axis, bin) in
                [bin.x as usize % BINS, bin.y as usize % BINS, bin.z as usize % BINS].into_iter().enumerate()
            {
                self.bounds[axis][bin].add(prim.lo, prim.hi);
                self.counts[axis][bin] += 1;
            }
        }
    }

    fn join(mut self, other: &Bins) -> Self {
        for axis in 0..3 {
            for bin in 0..BINS {
                self.bounds[axis][bin] = self.bounds[axis][bin].join(other.bounds[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }

    /// The cheapest cut, if there is one that leaves something on both sides. Whole leaves are what costs.
    fn best(&self, binning: &Binning, leaf_bits: u32) -> Option<Partition> {
        let leaves = |count: u32| ((count + (1 << leaf_bits) - 1) >> leaf_bits) as f32;
        let mut best = None;
        let mut least = f32::INFINITY;
        for axis in 0..3 {
            if binning.scale[axis] == 0.0 {
                continue;
            }
            // What lies right of each bin's left side
            let mut right = [0.0; BINS];
            let (mut bounds, mut count) = (Bounds::EMPTY, 0);
            for bin in (1..binning.bins).rev() {
                bounds = bounds.join(self.bounds[axis][bin]);
                count += self.counts[axis][bin];
                right[bin] = if count == 0 { f32::INFINITY } else { bounds.area() * leaves(count) };
            }
            let (mut bounds, mut count) = (Bounds::EMPTY, 0);
            for (bin, right) in right.iter().enumerate().take(binning.bins).skip(1) {
                bounds = bounds.join(self.bounds[axis][bin - 1]);
                count += self.counts[axis][bin - 1];
                if count == 0 {
                    continue;
                }
                let cost = bounds.area() * leaves(count) + right;
                if cost < least {
                    least = cost;
                    best = Some(Partition { binning: *binning, axis, bin: bin as u32 });
                }
            }
        }
        best
    }
}

/// The box around the boxes.
fn bounds_of(prims: &[Prim]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for prim in prims {
        bounds.add(prim.lo, prim.hi);
    }
    bounds
}

/// What all chunks have, joined.
fn join_chunks(prims: &[Prim], bounds: impl Fn(&[Prim]) -> Bounds + Sync) -> Bounds {
    let chunks: Vec<&[Prim]> = prims.chunks(CHUNK).collect();
    parallel::collect(chunks.len(), |i| bounds(chunks[i])).into_iter().fold(Bounds::EMPTY, Bounds::join)
}

/// The box around the centres.
fn centers_of(prims: &[Prim]) -> Bounds {
    let mut centers = Bounds::EMPTY;
    for prim in prims {
        centers.add(prim.center(), prim.center());
    }
    centers
}

/// Brings those left of the cut to the front, and says how many they are and where the centres on both sides are.
fn partition(prims: &mut [Prim], cut: &Partition) -> (usize, Bounds, Bounds) {
    let mut count = 0;
    let (mut left, mut right) = (Bounds::EMPTY, Bounds::EMPTY);
    let (lo, scale) = (cut.binning.lo[cut.axis], cut.binning.scale[cut.axis]);
    for i in 0..prims.len() {
        let prim = prims[i];
        let center = prim.center();
        let bin = ((center[cut.axis] - lo) * scale + ROUNDER).to_bits() & (BINS as u32 - 1);
        let is_left = bin < cut.bin;
        // No branch: which side it is cannot be foreseen
        prims[i] = prims[count];
        prims[count] = prim;
        count += usize::from(is_left);
        let mask = BVec4A::splat(is_left);
        left.add(Vec4::select(mask, center, Vec4::INFINITY), Vec4::select(mask, center, Vec4::NEG_INFINITY));
        right.add(Vec4::select(mask, Vec4::INFINITY, center), Vec4::select(mask, Vec4::NEG_INFINITY, center));
    }
    (count, left, right)
}

/// Halves by count.
fn halve(prims: &[Prim]) -> (usize, Bounds, Bounds) {
    let (left, right) = prims.split_at(prims.len() / 2);
    (left.len(), centers_of(left), centers_of(right))
}

impl Settings<'_> {
    /// Without the copies among primitives that no cut can part.
    fn without_copies<'p>(&self, prims: &'p mut [Prim], centers: Bounds) -> &'p mut [Prim] {
        let has_extent = (centers.hi - centers.lo).xyz().max_element() > 0.0;
        let count = if prims.len() <= self.leaf || has_extent { prims.len() } else { (self.distinct)(prims) };
        &mut prims[..count]
    }

    /// The tree above the tasks, and the tasks.
    fn top(&self, prims: &mut [Prim], centers: Bounds, base: u32, depth: usize) -> Top {
        let prims = self.without_copies(prims, centers);
        if prims.len() <= self.task {
            return Top::Part(self.part(prims, centers, base, depth));
        }
        let binning = Binning::new(centers, prims.len());
        let bins = if prims.len() >= PARALLEL {
            let chunks: Vec<&[Prim]> = prims.chunks(PARALLEL).collect();
            let parts = parallel::collect(chunks.len(), |i| Bins::of(chunks[i], &binning));
            parts.iter().skip(1).fold(parts[0].clone(), Bins::join)
        } else {
            Bins::of(prims, &binning)
        };
        let cut = if depth < MAX_DEPTH { bins.best(&binning, self.leaf_bits) } else { None };
        let (left, l_centers, r_centers) = match cut {
            Some(cut) => partition(prims, &cut),
            None => halve(prims),
        };
        let (l, r) = prims.split_at_mut(left);
        let (a, b) = rayon::join(
            || self.top(l, l_centers, base, depth + 1),
            || self.top(r, r_centers, base + left as u32, depth + 1),
        );
        let bounds = a.bounds().join(b.bounds());
        Top::Split(Box::new([a, b]), bounds)
    }

    /// A task: its binary tree, gathered into nodes.
    fn part(&self, prims: &mut [Prim], centers: Bounds, base: u32, depth: usize) -> Part {
        let mut binary = Vec::with_capacity(prims.len());
        let mut bins = Bins { bounds: [[Bounds::EMPTY; BINS]; 3], counts: [[0; BINS]; 3] };
        let bounds = self.cut(prims, centers, base, depth, &mut binary, &mut bins);
        let mut gather = Gather { binary, nodes: Vec::new(), leaves: Vec::new() };
        let (root, stack) = gather.take(0);
        Part { bounds, nodes: gather.nodes, leaves: gather.leaves, root, stack }
    }

    fn cut(
        &self,
        prims: &mut [Prim],
        centers: Bounds,
        base: u32,
        depth: usize,
        binary: &mut Vec<BinaryNode>,
        bins: &mut Bins,
    ) -> Bounds {
        let prims = self.without_copies(prims, centers);
        let place = binary.len();
        if prims.len() <= self.leaf {
            let bounds = bounds_of(prims);
            binary.push(BinaryNode { bounds, first: base, count: prims.len() as u32 });
            return bounds;
        }
        binary.push(BinaryNode { bounds: Bounds::EMPTY, first: 0, count: 0 });
        let mut cut = None;
        if depth < MAX_DEPTH {
            let binning = Binning::new(centers, prims.len());
            bins.clear(binning.bins);
            bins.fill(prims, &binning);
            cut = bins.best(&binning, self.leaf_bits);
        }
        let (left, l_centers, r_centers) = match cut {
            Some(cut) => partition(prims, &cut),
            None => halve(prims),
        };
        let (l, r) = prims.split_at_mut(left);
        let l_bounds = self.cut(l, l_centers, base, depth + 1, binary, bins);
        binary[place].first = binary.len() as u32;
        let r_bounds = self.cut(r, r_centers, base + left as u32, depth + 1, binary, bins);
        binary[place].bounds = l_bounds.join(r_bounds);
        binary[place].bounds
    }
}

/// Makes nodes of eight from a task's binary tree.
struct Gather {
    binary: Vec<BinaryNode>,
    nodes: Vec<BoxNode>,
    leaves: Vec<LeafRange>,
}

impl Gather {
    /// The child that stands for a binary node, and the stack needed below it.
    fn take(&mut self, index: u32) -> (u32, usize) {
        let BinaryNode { first, count, .. } = self.binary[index as usize];
        if count > 0 {
            self.leaves.push(LeafRange { first, count });
            return (LEAF | (self.leaves.len() - 1) as u32, 0);
        }
        // Open the largest box until there are eight
        let mut open = [0; WIDTH];
        (open[0], open[1]) = (index + 1, first);
        let mut len = 2;
        let area = |i: &u32| self.binary[*i as usize].bounds.area();
        while len < WIDTH {
            let inner = open[..len].iter().enumerate().filter(|(_, i)| self.binary[**i as usize].count == 0);
            let Some((place, &largest)) = inner.max_by(|a, b| area(a.1).total_cmp(&area(b.1))) else { break };
            open[place] = largest + 1;
            open[len] = self.binary[largest as usize].first;
            len += 1;
        }
        // In the order of the primitives, that what is near in space is near in memory
        open[..len].sort();
        let node = self.nodes.len();
        self.nodes.push(BoxNode::EMPTY);
        let mut stack = 0;
        for (place, &child) in open[..len].iter().enumerate() {
            let bounds = self.binary[child as usize].bounds;
            let (child, needed) = self.take(child);
            stack = stack.max(needed);
            self.nodes[node].set(place, bounds.lo.xyz().to_array(), bounds.hi.xyz().to_array(), child);
        }
        (node as u32, len + stack)
    }
}

impl Top {
    fn count(&self, nodes: &mut usize, leaves: &mut usize) {
        match self {
            Top::Split(halves, _) => halves.iter().for_each(|half| half.count(nodes, leaves)),
            Top::Part(part) => {
                *nodes += part.nodes.len();
                *leaves += part.leaves.len();
            }
        }
    }
}

/// Joins the parts under the top of the tree.
struct Join {
    nodes: Vec<BoxNode>,
    leaves: Vec<LeafRange>,
}

impl Join {
    /// The child that stands for a piece of the top, and the stack needed below it.
    fn take(&mut self, top: Top) -> (u32, usize) {
        let halves = match top {
            Top::Part(part) => return self.append(part),
            Top::Split(halves, _) => halves,
        };
        let mut open = Vec::from(*halves);
        while open.len() < WIDTH {
            let splits = open.iter().enumerate().filter(|(_, top)| matches!(top, Top::Split(..)));
            let largest = splits.max_by(|a, b| a.1.bounds().area().total_cmp(&b.1.bounds().area()));
            let Some((place, _)) = largest else { break };
            let Top::Split(halves, _) = open.remove(place) else { break };
            let [a, b] = *halves;
            open.splice(place..place, [a, b]);
        }
        let node = self.nodes.len();
        self.nodes.push(BoxNode::EMPTY);
        let (mut stack, len) = (0, open.len());
        for (place, child) in open.into_iter().enumerate() {
            let bounds = child.bounds();
            let (child, needed) = self.take(child);
            stack = stack.max(needed);
            self.nodes[node].set(place, bounds.lo.xyz().to_array(), bounds.hi.xyz().to_array(), child);
        }
        (node as u32, len + stack)
    }

    /// Appends a part, its indices moved.
    fn append(&mut self, part: Part) -> (u32, usize) {
        let (nodes, leaves) = (self.nodes.len() as u32, self.leaves.len() as u32);
        let moved = |child: u32| child + if child & LEAF != 0 { leaves } else { nodes };
        self.leaves.extend_from_slice(&part.leaves);
        self.nodes.extend(part.nodes.into_iter().map(|mut node| {
            for (place, child) in node.children.iter_mut().enumerate() {
                // Places without a box stay as they are
                if node.planes[0][0][place] <= node.planes[0][1][place] {
                    *child = moved(*child);
                }
            }
            node
        }));
        (moved(part.root), part.stack)
    }
}
