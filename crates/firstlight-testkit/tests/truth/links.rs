//! Which lights shine on what, and for which it casts shadows: pictures against the sums of pictures under one light
//! each.

use firstlight::{
    BoxDesc, CameraHit, Image, LightDesc, MeshDesc, PointSetDesc, RectangleDesc, RenderSettings, SampleSet, SceneDesc,
    ShapeDesc,
};

use crate::scenes::*;

const SIZE: u32 = 40;
const NAMES: [&str; 3] = ["a", "b", "c"];

/// Which lights of [`NAMES`] shine on something, and for which it casts shadows.
type Chosen = [[bool; 3]; 2];

/// A lamp and two areas; two of the three have one name in `doubled`.
fn lights(doubled: bool) -> Vec<LightDesc> {
    let name = |i: usize| Some(if doubled && i == 2 { NAMES[1] } else { NAMES[i] }.to_owned());
    let area = |center, set| rectangle(center, [0.6, 0.0, 0.0], [0.0, 0.0, 0.6], set, 16);
    vec![
        LightDesc::Point(firstlight::PointDesc { name: name(0), ..point([1.5, 3.0, 1.0], 9.0) }),
        LightDesc::Rectangle(RectangleDesc { name: name(1), ..area([-1.5, 2.5, 0.5], SampleSet::Sobol) }),
        LightDesc::Rectangle(RectangleDesc { name: name(2), ..area([0.3, 3.0, -1.0], SampleSet::Grid) }),
    ]
}

/// A shape over a floor, under a lid that is no light's: nothing else chooses.
fn scene(shape: ShapeDesc, groups: &[(&str, ShapeDesc)]) -> SceneDesc {
    let mut scene = empty(SIZE, SIZE, 1)
        .with_camera(camera([0.0, 2.4, 4.5], [0.0, 0.4, 0.0], 40.0))
        .with_parallelogram(square([0.0; 3], [0.0, 1.0, 0.0], 3.0))
        .with_sphere(sphere([0.9, 0.3, 0.5], 0.3))
        .with_shape(shape);
    for (name, shape) in groups {
        scene = scene.with_group(name, vec![shape.clone()]);
    }
    scene
}

/// The fast picture, after the reference was seen to have the same bits.
fn both(desc: &SceneDesc) -> Image {
    let scene = compile(desc);
    let fast = picture(&scene, &every_ray());
    let plain = picture(&scene, &RenderSettings { reference: true, ..one_thread() });
    assert!(bits(&fast) == bits(&plain), "fast and plain differ: {desc:#?}");
    fast
}

fn names(of: [bool; 3]) -> Vec<String> {
    (0..3).filter(|i| of[*i]).map(|i| NAMES[i].to_owned()).collect()
}

/// The shape with lists for `chosen`, included or, for bits of `how` that are set, excluded.
fn chooses(mut shape: ShapeDesc, chosen: Chosen, how: u32) -> ShapeDesc {
    let [lights_include, lights_exclude, shadow_include, shadow_exclude] = common(&mut shape).links;
    for (i, (include, exclude)) in
        [(lights_include, lights_exclude), (shadow_include, shadow_exclude)].into_iter().enumerate()
    {
        if how >> i & 1 == 1 {
            *exclude = Some(names(chosen[i].map(|b| !b)));
        } else {
            *include = Some(names(chosen[i]));
        }
    }
    shape
}

fn random_choice(random: &mut Random) -> Chosen {
    [(); 2].map(|_| [(); 3].map(|_| random.chance(0.5)))
}

/// The picture is the sum, over all lights, of the pictures under each alone, with the shape casting a shadow or not;
/// and where the shape is seen, of the lights that shine on it.
fn is_the_sum(desc: &SceneDesc, plain: &SceneDesc, chosen: Chosen, is_it: &dyn Fn(u32) -> bool) {
    let all = lights(false);
    let image = both(&desc.clone().lit_by(&all));
    let parts: Vec<Image> = (0..3)
        .map(|i| {
            let mut one = plain.clone().lit_by(&all[i..=i]);
            let last = one.shapes.last_mut().expect("there is one");
            *common(last).casts_shadow = chosen[1][i];
            both(&one)
        })
        .collect();
    let compiled = compile(&desc.clone().lit_by(&all));
    let mut seen = 0;
    for (at, pixel) in image.pixels.iter().enumerate() {
        let (x, y) = ((at as u32 % SIZE) as f32 + 0.5, (at as u32 / SIZE) as f32 + 0.5);
        let (ray, differential) = compiled.camera().ray(x, y, 1.0);
        let CameraHit::Surface(si) = compiled.look(&ray, &differential) else { continue };
        let mine = is_it(si.surface.0);
        seen += u32::from(mine);
        let counts = |i: &usize| !mine || chosen[0][*i];
        let sum: f32 = (0..3).filter(counts).map(|i| parts[i].pixels[at][0]).sum();
        assert!((pixel[0] - sum).abs() <= 2e-6 * (1.0 + sum), "{} is not {sum} at {x} {y}: {desc:#?}", pixel[0]);
    }
    assert!(seen > 20, "{seen}");
}

fn shapes() -> Vec<ShapeDesc> {
    let random = &mut Random::new(5);
    vec![
        ShapeDesc::Sphere(sphere([-0.2, 0.7, 0.0], 0.6)),
        ShapeDesc::Parallelogram(parallelogram([-0.9, 0.5, -0.5], [1.4, 0.3, 0.0], [0.0, 0.2, 1.0])),
        ShapeDesc::Box(BoxDesc { size: [0.9, 0.9, 0.9], ..BoxDesc::new([-0.2, 0.6, 0.0]) }),
        moved(ShapeDesc::Mesh(ball_mesh(0.6, 8, 0.1, true, random)), [-0.2, 0.7, 0.0], [0.0; 3], [1.0; 3]),
        ShapeDesc::PointSet(PointSetDesc {
            positions: (0..20).map(|_| add([-0.2, 0.8, 0.0], random.vector(0.5))).collect(),
            radius: Some(0.2),
            ..PointSetDesc::default()
        }),
    ]
}

#[test]
fn pictures_are_sums_over_the_lights_that_are_chosen() {
    let random = &mut Random::new(8);
    for shape in shapes() {
        for how in 0..4 {
            let chosen = random_choice(random);
            let plain = scene(shape.clone(), &[]);
            let desc = scene(chooses(shape.clone(), chosen, how), &[]);
            // The floor and the ball are the others, numbered by kind
            let is_it = |surface: u32| match &shape {
                ShapeDesc::Sphere(_) => surface == 1,
                _ => surface == 2,
            };
            is_the_sum(&desc, &plain, chosen, &is_it);
        }
    }
}

#[test]
fn lists_of_instances_and_of_what_they_place_have_both_to_allow() {
    let random = &mut Random::new(9);
    for shape in shapes() {
        for how in 0..4 {
            let [own, inner, outer] = [(); 3].map(|_| random_choice(random));
            let chosen = [0, 1].map(|k| [0, 1, 2].map(|i| own[k][i] && inner[k][i] && outer[k][i]));
            let of = |listed: bool| {
                let list = |shape: ShapeDesc, chosen, how| if listed { chooses(shape, chosen, how) } else { shape };
                let leaf = list(shape.clone(), own, how);
                let first = list(instance("leaf"), inner, 3 - how);
                scene(list(instance("branch"), outer, how), &[("leaf", leaf), ("branch", first)])
            };
            is_the_sum(&of(true), &of(false), chosen, &|surface| surface == 2);
        }
    }
}

#[test]
fn many_spheres_in_the_tree_choose_as_those_in_the_list_do() {
    let random = &mut Random::new(10);
    let mut few = scene(ShapeDesc::Sphere(sphere([-0.2, 0.7, 0.0], 0.6)), &[]).lit_by(&lights(false));
    for _ in 0..12 {
        let small = ShapeDesc::Sphere(sphere(add([0.0, 1.0, 0.0], random.vector(1.0)), 0.1));
        let flat = ShapeDesc::Parallelogram(square(add([0.0, 1.2, 0.0], random.vector(1.0)), random.direction(), 0.1));
        few = few.with_shape(chooses(small, random_choice(random), 1)).with_shape(chooses(
            flat,
            random_choice(random),
            2,
        ));
    }
    let mut many = few.clone();
    for i in 0..40 {
        // Out of sight, and of every light's way
        many = many.with_sphere(sphere([0.0, -5.0 - i as f64, 0.0], 0.4));
    }
    assert!(bits(&both(&few)) == bits(&both(&many)));
}

#[test]
fn lists_that_leave_nothing_out_or_everything_are_flags() {
    for shape in shapes() {
        let of = |lists: [Option<Vec<&str>>; 4], casts: bool| {
            let mut shape = shape.clone();
            for (to, list) in common(&mut shape).links.into_iter().zip(lists) {
                *to = list.map(|list| list.into_iter().map(str::to_owned).collect());
            }
            *common(&mut shape).casts_shadow = casts;
            both(&scene(shape, &[]).lit_by(&lights(true)))
        };
        let plain = bits(&of([None, None, None, None], true));
        // "b" is the name of two
        let (all, none) = (Some(vec!["b", "a"]), Some(vec![]));
        assert!(bits(&of([all.clone(), None, all, None], true)) == plain);
        assert!(bits(&of([None, none.clone(), None, none.clone()], true)) == plain);
        let unshaded = bits(&of([None, None, none.clone(), None], true));
        assert!(unshaded == bits(&of([None, None, None, None], false)) && unshaded != plain);
        assert!(unshaded == bits(&of([None, None, None, Some(vec!["a", "b"])], true)));
        // No light at all, but what the camera sees of it
        let dark = of([none, None, None, None], true);
        assert!(dark.pixels.iter().any(|p| p[0] == 0.0 && p[3] == 1.0));
    }
}

#[test]
fn a_mesh_with_normals_is_linked_like_any_other() {
    let ball = MeshDesc { smooth_deg: Some(180.0), ..box_mesh([-0.2, 0.7, 0.0], [0.8, 0.8, 0.8]) };
    let chosen = [[true, false, true], [false, true, true]];
    let desc = scene(chooses(ShapeDesc::Mesh(ball.clone()), chosen, 0), &[]);
    is_the_sum(&desc, &scene(ShapeDesc::Mesh(ball), &[]), chosen, &|surface| surface == 2);
}
