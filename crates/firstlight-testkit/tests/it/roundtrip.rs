//! Text of a description reads back to an equal one.

use firstlight::*;
use proptest::collection::{hash_map, vec};
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

/// Strings that a writer could get wrong.
fn text() -> impl Strategy<Value = String> {
    prop_oneof![
        any::<String>(),
        "[a-z_-]{0,8}",
        select(vec![
            "",
            " ",
            ".",
            "a.b",
            "a[0].b",
            "\"",
            "\\",
            "'''",
            "\"\"\"",
            "\n",
            "\r\n",
            "\t",
            "\0",
            "\u{7f}",
            "\u{feff}",
            "\u{2028}",
            "#",
            "# no comment",
            "true",
            "1",
            "nan",
            "\u{1f534}",
            "${x}",
            "</script>",
            "\u{85}",
        ])
        .prop_map(str::to_owned),
    ]
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        -10.0..10.0,
        any::<i32>().prop_map(f64::from),
        any::<f64>().prop_filter("is finite", |v| v.is_finite()),
        select(vec![
            0.0,
            -0.0,
            f64::MAX,
            f64::MIN,
            f64::MIN_POSITIVE,
            5e-324,
            1e15,
            1e16,
            1e21,
            1e-7,
            9007199254740993.0
        ]),
    ]
}

fn vector() -> impl Strategy<Value = [f64; 3]> {
    [number(), number(), number()]
}

fn color() -> impl Strategy<Value = ColorDesc> {
    prop_oneof![number().prop_map(ColorDesc::gray), vector().prop_map(ColorDesc::from)]
}

fn color_param() -> impl Strategy<Value = ColorParam> {
    (proptest::option::of(text()), color())
        .prop_map(|(texture, factor)| ColorParam { texture, ..ColorParam::constant(factor) })
}

fn number_param() -> impl Strategy<Value = NumberParam> {
    (proptest::option::of(text()), number(), select(Channel::ALL), number()).prop_map(
        |(texture, factor, channel, bias)| match texture {
            Some(_) => NumberParam { texture, factor, channel, bias },
            None => NumberParam::constant(factor),
        },
    )
}

fn maybe<T: std::fmt::Debug + Clone>(strategy: impl Strategy<Value = T>) -> impl Strategy<Value = Option<T>> {
    proptest::option::of(strategy)
}

fn samples() -> impl Strategy<Value = SamplesDesc> {
    prop_oneof![Just(SamplesDesc::Exact), any::<u32>().prop_map(SamplesDesc::Count)]
}

fn buffer() -> impl Strategy<Value = BufferDesc> {
    let light = prop_oneof![
        Just(LightChoice::All),
        (1..=u32::MAX).prop_map(LightChoice::Number),
        "[a-z ]{1,8}".prop_map(LightChoice::Name)
    ];
    let of_light =
        (light.clone(), maybe(select(LightPart::ALL))).prop_map(|(light, part)| BufferDesc::Light { light, part });
    let of_groups = vec![LightPart::Diffuse, LightPart::Specular, LightPart::Unshadowed, LightPart::Visibility];
    let of_group =
        (light.clone(), maybe(select(of_groups))).prop_map(|(group, part)| BufferDesc::Group { group, part });
    let of_object = light.prop_map(BufferDesc::Coverage);
    prop_oneof![select(Plane::ALL).prop_map(BufferDesc::Plane), of_light, of_group, of_object]
}

fn motion_to() -> impl Strategy<Value = MotionTo> {
    prop_oneof![
        number().prop_map(MotionTo::Time),
        "[a-z ]{1,8}".prop_map(|name| MotionTo::from_name(&name).unwrap()),
        select(vec![MotionTo::Next, MotionTo::Previous])
    ]
}

prop_compose! {
    fn render()(
        size in [any::<u32>(), any::<u32>(), any::<u32>()], camera in maybe(text()),
        samples in samples(), colors in [color(), color()], transparent: bool, display in select(DisplayEncoding::ALL),
        gamma in number(), exposure in number(), fps in number(), tolerance in number(),
        shadow_terminator in select(ShadowTerminator::ALL), buffers in vec(buffer(), 0..4),
        motion_to in maybe(motion_to()),
    ) -> RenderDesc {
        RenderDesc {
            width: size[0], height: size[1], antialiasing: size[2], samples, camera, background: colors[0],
            transparent, ambient: colors[1].into(), display, gamma, exposure, fps, shadow_terminator, tolerance,
            buffers, motion_to,
        }
    }
}

prop_compose! {
    fn camera()(
        position in vector(), look_at in vector(), up in vector(), projection in select(Projection::ALL),
        sizes in [maybe(number()), maybe(number()), maybe(number()), maybe(number())], shift in [number(), number()],
        pixels in [maybe([number(), number()]), maybe([number(), number()])], transform in moved(),
    ) -> CameraDesc {
        let [focal_length_px, principal_point_px] = pixels;
        let [fov_y_deg, focal_length_mm, sensor_height_mm, height] = sizes;
        CameraDesc {
            position, look_at, up, projection, fov_y_deg, focal_length_mm, sensor_height_mm, focal_length_px,
            principal_point_px, height, shift, transform,
        }
    }
}

fn links() -> impl Strategy<Value = [Option<Vec<String>>; 4]> {
    [(); 4].map(|_| maybe(vec(text(), 0..3)))
}

/// A shape's own fields with what all shapes can say.
macro_rules! with_common {
    ($variant:ident, $own:expr) => {
        ($own, maybe(text()), maybe(text()), maybe(transform()), any::<[bool; 4]>(), links())
            .prop_map(|(own, name, material, transform, flags, links)| {
                let [visible, casts_shadow, receives_shadow, single_sided] = flags;
                let mut desc = own;
                (desc.name, desc.material, desc.transform) = (name, material, transform.map(Box::new));
                (desc.visible, desc.casts_shadow) = (visible, casts_shadow);
                (desc.receives_shadow, desc.single_sided) = (receives_shadow, single_sided);
                [desc.lights_include, desc.lights_exclude, desc.shadow_include, desc.shadow_exclude] = links;
                ShapeDesc::$variant(desc)
            })
            .boxed()
    };
}

fn several(strategy: impl Strategy<Value = [f64; 3]>) -> impl Strategy<Value = Vec<[f64; 3]>> {
    vec(strategy, 0..3)
}

fn mesh() -> impl Strategy<Value = MeshDesc> {
    let uvs = || vec([number(), number()], 0..3);
    let lists = (several(vector()), vec(any::<[u32; 3]>(), 0..3), several(vector()), (uvs(), vec(uvs(), 0..3)));
    let faces = (several(vector()), vec(text(), 0..3), vec(any::<u32>(), 0..3));
    (maybe(text()), lists, any::<u32>(), faces, maybe(number())).prop_map(
        |(
            file,
            (positions, triangles, normals, (uvs, more_uvs)),
            uv_set,
            (colors, materials, face_materials),
            smooth_deg,
        )| {
            let file = file.map(FilePath::from);
            let lists = MeshDesc { positions, triangles, normals, uvs, more_uvs, ..MeshDesc::default() };
            MeshDesc { file, uv_set, colors, materials, face_materials, smooth_deg, ..lists }
        },
    )
}

fn point_set() -> impl Strategy<Value = PointSetDesc> {
    (maybe(text()), several(vector()), vec(number(), 0..3), several(vector()), maybe(number())).prop_map(
        |(file, positions, radii, colors, radius)| {
            let file = file.map(FilePath::from);
            PointSetDesc { file, positions, radii, colors, radius, ..PointSetDesc::default() }
        },
    )
}

fn model() -> impl Strategy<Value = ModelDesc> {
    let names = hash_map(text(), text(), 0..3).prop_map(|names| NameMap(names.into_iter().collect()));
    let of_gltf = ([maybe(text()), maybe(text())], maybe(any::<u32>()), maybe(number()), any::<[bool; 2]>());
    (text(), maybe(select(UpAxis::ALL)), names, of_gltf, maybe(number()), any::<bool>()).prop_map(
        |(file, up, materials, ([variant, animation], scene, time, [lights, cameras]), smooth_deg, unlit)| {
            let new = ModelDesc { up, materials, smooth_deg, unlit, ..ModelDesc::new(file.into()) };
            ModelDesc { variant, scene, animation, time, lights, cameras, ..new }
        },
    )
}

fn shape() -> impl Strategy<Value = ShapeDesc> {
    let sphere = (vector(), number(), select(SphereUv::ALL))
        .prop_map(|(center, radius, uv)| SphereDesc { uv, ..SphereDesc::new(center, radius) });
    let parallelogram = ([vector(), vector(), vector()], any::<bool>())
        .prop_map(|([p, e0, e1], flip)| ParallelogramDesc { flip, ..ParallelogramDesc::new(p, e0, e1) });
    let plane = ([vector(), vector()], maybe(vector())).prop_map(|([point, normal], up)| PlaneDesc {
        point,
        normal,
        up,
        ..PlaneDesc::default()
    });
    let disk = ([vector(), vector()], [number(), number()]).prop_map(|([center, normal], [radius, inner_radius])| {
        DiskDesc { normal, inner_radius, ..DiskDesc::new(center, radius) }
    });
    let rectangle =
        ([vector(), vector()], [number(), number()], maybe(vector())).prop_map(|([center, normal], size, up)| {
            RectangleShapeDesc { normal, up, ..RectangleShapeDesc::new(center, size) }
        });
    let cuboid = [vector(), vector()].prop_map(|[center, size]| BoxDesc { size, ..BoxDesc::new(center) });
    let cylinder = ([vector(), vector()], number(), any::<bool>())
        .prop_map(|([p0, p1], radius, capped)| CylinderDesc { capped, ..CylinderDesc::new(p0, p1, radius) });
    let cone = ([vector(), vector()], [number(), number()], any::<bool>())
        .prop_map(|([p0, p1], [r0, r1], capped)| ConeDesc { radius1: r1, capped, ..ConeDesc::new(p0, p1, r0) });
    let torus = ([vector(), vector()], [number(), number()])
        .prop_map(|([center, axis], [major, minor])| TorusDesc { axis, ..TorusDesc::new(center, major, minor) });
    prop_oneof![
        with_common!(Sphere, sphere),
        with_common!(Parallelogram, parallelogram),
        with_common!(Plane, plane),
        with_common!(Disk, disk),
        with_common!(Rectangle, rectangle),
        with_common!(Box, cuboid),
        with_common!(Cylinder, cylinder),
        with_common!(Cone, cone),
        with_common!(Torus, torus),
        with_common!(Mesh, mesh()),
        with_common!(PointSet, point_set()),
        with_common!(Instance, text().prop_map(InstanceDesc::new)),
        with_common!(Model, model()),
    ]
}

fn scale() -> impl Strategy<Value = ScaleDesc> {
    prop_oneof![number().prop_map(ScaleDesc::from), vector().prop_map(ScaleDesc::from)]
}

fn key() -> impl Strategy<Value = TransformKeyDesc> {
    let quaternion = [number(), number(), number(), number()];
    (number(), maybe(vector()), maybe(vector()), maybe(vector()), maybe(number()), maybe(quaternion), maybe(scale()))
        .prop_map(|(time, translate, rotate_deg, rotate_axis, angle_deg, quaternion, scale)| TransformKeyDesc {
            time,
            translate,
            rotate_deg,
            rotate_axis,
            angle_deg,
            quaternion,
            scale,
        })
}

fn transform() -> impl Strategy<Value = TransformDesc> {
    let turn = (vector(), maybe(vector()), maybe(number()), maybe([number(), number(), number(), number()]));
    let matrix = maybe(vec(number(), 12).prop_map(|m| m.try_into().unwrap()));
    (vector(), turn, scale(), matrix, vec(key(), 0..4), select(Interpolation::ALL)).prop_map(
        |(translate, (rotate_deg, rotate_axis, angle_deg, quaternion), scale, matrix, keys, interpolation)| {
            let turned = TransformDesc { rotate_deg, rotate_axis, angle_deg, quaternion, ..TransformDesc::default() };
            TransformDesc { translate, scale, matrix, keys, interpolation, ..turned }
        },
    )
}

/// On the heap: these are large, and a scene has many.
fn moved() -> BoxedStrategy<Option<Box<TransformDesc>>> {
    maybe(transform().prop_map(Box::new)).boxed()
}

fn light() -> impl Strategy<Value = LightDesc> {
    let common = || ([maybe(text()), maybe(text())], color(), number(), select(Falloff::ALL), any::<bool>());
    let point = (vector(), moved(), common()).prop_map(
        |(position, transform, ([name, group], color, strength, falloff, shadows))| {
            LightDesc::Point(PointDesc { name, group, position, transform, color, strength, falloff, shadows })
        },
    );
    let directional = (vector(), moved(), common()).prop_map(
        |(direction, transform, ([name, group], color, strength, falloff, shadows))| {
            LightDesc::Directional(DirectionalDesc {
                name,
                group,
                direction,
                transform,
                color,
                strength,
                falloff,
                shadows,
            })
        },
    );
    let spot = ([vector(), vector()], moved(), number(), maybe(number()), common()).prop_map(
        |(
            [position, look_at],
            transform,
            cone_deg,
            inner_cone_deg,
            ([name, group], color, strength, falloff, shadows),
        )| {
            let new = SpotDesc { look_at, transform, cone_deg, inner_cone_deg, ..SpotDesc::new(position) };
            LightDesc::Spot(SpotDesc { name, group, color, strength, falloff, shadows, ..new })
        },
    );
    /// An area light's own fields with what all of them can say.
    macro_rules! area {
        ($variant:ident, $own:expr) => {
            (
                $own,
                moved(),
                maybe(select(EmitSides::ALL)),
                any::<[bool; 2]>(),
                maybe(samples()),
                select(SampleSet::ALL),
                any::<u32>(),
                common(),
            )
                .prop_map(|(own, transform, sides, [visible, blocks], samples, set, seed, common)| {
                    let mut light = own;
                    ([light.name, light.group], light.color, light.strength, light.falloff, light.shadows) = common;
                    (light.transform, light.sides, light.visible, light.blocks) = (transform, sides, visible, blocks);
                    (light.samples, light.set, light.seed) = (samples, set, seed);
                    LightDesc::$variant(light)
                })
                .boxed()
        };
    }
    let edges = [option::of(vector()), option::of(vector())];
    let facing = [option::of(vector()), option::of(vector()), option::of(vector())];
    let flat = (vector(), edges, option::of([number(), number()]), facing);
    let flat = flat.prop_map(|(center, [e0, e1], size, [look_at, normal, up])| RectangleDesc {
        e0,
        e1,
        size,
        look_at,
        normal,
        up,
        ..RectangleDesc::new(center)
    });
    let rectangle = area!(Rectangle, flat);
    let round = (vector(), [option::of(vector()), option::of(vector())], [option::of(number()), option::of(number())]);
    let round = round.prop_map(|(center, [normal, look_at], [radius, size])| DiskLightDesc {
        normal,
        look_at,
        radius,
        size,
        ..DiskLightDesc::new(center)
    });
    let disk = area!(Disk, round);
    let ball = (vector(), number());
    let sphere = area!(Sphere, ball.prop_map(|(center, radius)| SphereLightDesc::new(center, radius)));
    prop_oneof![point.boxed(), directional.boxed(), spot.boxed(), rectangle, disk, sphere]
}

fn material() -> impl Strategy<Value = MaterialDesc> {
    let common = (color_param(), number()).prop_map(|(emissive, emissive_strength)| MaterialCommonDesc {
        emissive,
        emissive_strength,
        ..MaterialCommonDesc::default()
    });
    (any::<bool>(), color_param(), color_param(), maybe(color_param()), number_param(), common).prop_map(
        |(blinn, diffuse, specular, ambient, shininess, common)| match blinn {
            true => MaterialDesc::BlinnPhong(BlinnPhongDesc { diffuse, specular, ambient, shininess, common }),
            false => MaterialDesc::Phong(PhongDesc { diffuse, specular, ambient, shininess, common }),
        },
    )
}

fn texture() -> impl Strategy<Value = TextureDesc> {
    let checkerboard = (any::<[u32; 2]>(), [color(), color()], maybe(any::<u32>()))
        .prop_map(|(counts, colors, uv_set)| TextureDesc::Checkerboard(CheckerboardDesc { counts, colors, uv_set }));
    let image = (
        text(),
        [select(Wrap::ALL), select(Wrap::ALL)],
        select(Filter::ALL),
        maybe(select(TextureSpace::ALL)),
        color(),
        ([[number(), number()], [number(), number()]], maybe(any::<u32>())),
    )
        .prop_map(|(file, wrap, filter, color_space, border, ([scale, offset], uv_set))| {
            let new = ImageTextureDesc { rotate_deg: scale[1], uv_set, ..ImageTextureDesc::new(file.into()) };
            TextureDesc::Image(ImageTextureDesc { wrap, filter, color_space, border, scale, offset, ..new })
        });
    let grid = (any::<[u32; 2]>(), maybe(any::<u32>()))
        .prop_map(|(counts, uv_set)| TextureDesc::UvGrid(UvGridDesc { counts, uv_set }));
    prop_oneof![checkerboard, image, grid]
}

prop_compose! {
    fn scene()(
        render in prop_oneof![Just(RenderDesc::default()), render()],
        cameras in prop_oneof![
            camera().prop_map(|c| vec![(String::new(), c)]).boxed(),
            hash_map(text(), camera(), 0..4).prop_map(|m| m.into_iter().collect()).boxed(),
        ],
        textures in hash_map(text(), texture(), 0..4), materials in hash_map(text(), material(), 0..4),
        shapes in vec(shape(), 0..6), groups in hash_map(text(), vec(shape(), 1..4), 0..3),
        lights in vec(light(), 0..6),
    ) -> SceneDesc {
        let mut desc = SceneDesc {
            render, cameras, textures: textures.into_iter().collect(), materials: materials.into_iter().collect(),
            shapes, groups: groups.into_iter().map(|(name, shapes)| (name, GroupDesc { shapes })).collect(), lights,
        };
        desc.sort();
        desc
    }
}

fn assert_reads_back(desc: &SceneDesc, name: &str, text: &str) {
    let parsed = SceneDesc::parse(name, text.as_bytes(), &NoAssets);
    assert_eq!(parsed.faults(), [], "{text}");
    assert_eq!(parsed.desc, *desc, "{text}");
}

proptest! {
    #[test]
    fn text_reads_back_to_an_equal_description(desc in scene()) {
        assert_reads_back(&desc, "scene.toml", &desc.to_toml());
        assert_reads_back(&desc, "scene.json", &desc.to_json());
    }

    #[test]
    fn no_text_can_break_the_reader(text: Vec<u8>, words in vec(select(FRAGMENTS), 0..40)) {
        let words = words.concat();
        for name in ["a.toml", "a.json", "a.txt", "a"] {
            for text in [text.as_slice(), words.as_bytes()] {
                let parsed = SceneDesc::parse(name, text, &NoAssets);
                if parsed.faults().is_empty() && parsed.output.is_none() {
                    assert_reads_back(&parsed.desc, "scene.toml", &parsed.desc.to_toml());
                }
            }
        }
    }
}

/// Pieces of scene text that meet by chance.
const FRAGMENTS: &[&str] = &[
    "[[sphere]]\n",
    "[camera]\n",
    "[camera.a]\n",
    "[render]\n",
    "[material.phong.a]\n",
    "[[light.spot]]\n",
    "[[group.a.box]]\n",
    "[group.a]\n",
    "[[instance]]\n",
    "[[mesh]]\n",
    "of = \"a\"\n",
    "triangles = ",
    "include = ",
    "[\"a.toml\"]\n",
    "center = ",
    "radius = ",
    "[0, 1, 2]\n",
    "1\n",
    "\"#ff0000\"\n",
    "[",
    "]",
    "{",
    "}",
    "\"",
    "'",
    "=",
    ",",
    ":",
    ".",
    "\n",
    " ",
    "a",
    "\"sphere\"",
    "\"light\"",
    "null",
    "true",
    "1e999",
    "nan",
    "-",
    "\u{e4}",
    "\\u0041",
    "\"\"\"",
    "#",
    "camera_id 1\n",
    "num_samples ",
    "{}",
    "[]",
    "\"center\": [0, 0, 0]",
    "{\"radius\": 1}",
    "diffuse = { texture = \"a\" }\n",
];

#[test]
fn lists_come_back_in_scene_order() {
    let light = LightDesc::Point(PointDesc::new([0.0; 3]));
    let quad = ShapeDesc::Parallelogram(ParallelogramDesc::new([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]));
    let ball =
        |x: f64| ShapeDesc::Sphere(SphereDesc { material: Some("red".into()), ..SphereDesc::new([x, 0.0, 0.0], 1.0) });
    let mut desc = SceneDesc { shapes: vec![ball(2.0), quad, ball(1.0)], lights: vec![light], ..SceneDesc::default() };
    let (toml, json) = (desc.to_toml(), desc.to_json());
    desc.sort();
    assert_eq!(desc.shapes[1], ball(1.0));
    assert_reads_back(&desc, "scene.toml", &toml);
    assert_reads_back(&desc, "scene.json", &json);
}

#[test]
fn an_infinite_number_reads_back_from_toml() {
    let sphere = SphereDesc::new([f64::INFINITY, f64::NEG_INFINITY, 0.0], 1.0);
    let desc = SceneDesc { shapes: vec![ShapeDesc::Sphere(sphere)], ..SceneDesc::default() };
    assert_reads_back(&desc, "scene.toml", &desc.to_toml());
    assert!(!SceneDesc::parse("scene.json", desc.to_json().as_bytes(), &NoAssets).faults().is_empty());
}

#[test]
fn built_in_scenes_read_back() {
    for scene in builtin_scenes() {
        let desc = SceneDesc::parse("scene.toml", scene.text.as_bytes(), &NoAssets).desc;
        assert_reads_back(&desc, "scene.toml", &desc.to_toml());
        assert_reads_back(&desc, "scene.json", &desc.to_json());
    }
}
