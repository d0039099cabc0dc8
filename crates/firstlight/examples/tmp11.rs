use firstlight::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let size: u32 = args[1].parse().unwrap();
    let level = args[2].as_str();
    let threads: usize = args[3].parse().unwrap();
    let g = |c: [f64; 3], s: f64| {
        let p = ParamDesc::constant(ColorDesc::linear(c[0], c[1], c[2]));
        MaterialDesc::BlinnPhong(BlinnPhongDesc {
            diffuse: p.clone(),
            specular: p,
            ambient: None,
            shininess: NumberParam::constant(s),
        })
    };
    let gray = [0.7; 3];
    let mut materials = vec![
        ("gray".to_string(), g(gray, 16.0)),
        ("red".into(), g([1., 0., 0.], 16.0)),
        ("green".into(), g([0., 1., 0.], 16.0)),
    ];
    let mut textures = vec![];
    let mut shapes = vec![];
    for (i, (c, r, a, b, n, s)) in [
        ([3., 1., -7.], 1.5, [0., 0., 1.], [1., 1., 1.], 4, 22.),
        ([2., -3.2, -5.], 1., [0.2, 0.5, 0.], [0.9, 0., 0.4], 4, 40.),
        ([-4., 2., -5.], 1.8, [1., 1., 1.], [0., 0., 0.], 8, 120.),
        ([-2., -4.5, -8.], 2., [0.3, 1., 0.4], [0.3, 0.7, 0.2], 4, 16.),
    ]
    .into_iter()
    .enumerate()
    {
        let nm = format!("t{i}");
        let col = |c: [f64; 3]| ColorDesc::linear(c[0], c[1], c[2]);
        textures.push((
            nm.clone(),
            TextureDesc::Checkerboard(CheckerboardDesc { counts: [n, n], colors: [col(a), col(b)] }),
        ));
        let p = ColorParam::texture(nm.clone());
        materials.push((
            nm.clone(),
            MaterialDesc::BlinnPhong(BlinnPhongDesc {
                diffuse: p.clone(),
                specular: p,
                ambient: None,
                shininess: NumberParam::constant(s),
            }),
        ));
        shapes.push(ShapeDesc::Sphere(SphereDesc {
            name: None,
            center: c,
            radius: r,
            uv: SphereUv::Angles,
            material: Some(nm),
            single_sided: false,
        }));
    }
    for (p, e0, e1, flip, m) in [
        ([-10., -10., -10.], [20., 0., 0.], [0., 20., 0.], false, "gray"),
        ([-6., -7., -11.], [0., 0., 20.], [0., 20., 0.], true, "red"),
        ([6., -7., -11.], [0., 0., 20.], [0., 20., 0.], false, "green"),
        ([-7., -6., -11.], [20., 0., 0.], [0., 0., 20.], true, "gray"),
        ([-7., 6., -11.], [20., 0., 0.], [0., 0., 20.], false, "gray"),
    ] {
        shapes.push(ShapeDesc::Parallelogram(ParallelogramDesc {
            name: None,
            p,
            e0,
            e1,
            flip,
            material: Some(m.into()),
            single_sided: false,
        }));
    }
    let desc = SceneDesc {
        render: RenderDesc {
            width: size,
            height: size,
            antialiasing: 4,
            samples: 400,
            camera: None,
            background: ColorDesc::BLACK,
            transparent: false,
            ambient: ColorDesc::gray(0.1),
            display: DisplayEncoding::Gamma,
            gamma: 2.2,
            exposure: 0.,
        },
        cameras: vec![(
            "".into(),
            CameraDesc {
                position: [0., 0., 10.],
                look_at: [0.; 3],
                up: [0., 1., 0.],
                fov_y_deg: Some(45.),
                focal_length_mm: None,
                sensor_height_mm: None,
            },
        )],
        textures,
        materials,
        shapes,
        lights: vec![LightDesc::Rectangle(RectangleDesc {
            name: None,
            center: [0., 5.9, -6.],
            e0: [2., 0., 0.],
            e1: [0., 0., 2.],
            color: ColorDesc::WHITE,
            strength: 1.,
            falloff: Falloff::Constant,
            sides: None,
            visible: true,
            blocks: false,
            shadows: true,
            samples: None,
            set: SampleSet::Sobol,
            seed: 0,
        })],
    };
    let scene = desc.compile(&NoAssets, &CompileOptions::default()).unwrap().scene;
    let simd = *SimdLevel::ALL.iter().find(|l| l.name() == level).unwrap_or(&SimdLevel::Auto);
    let settings = RenderSettings {
        threads: std::num::NonZeroUsize::new(threads),
        simd,
        reference: level == "reference",
        ..Default::default()
    };
    let t = std::time::Instant::now();
    let std::ops::ControlFlow::Continue((film, stats)) =
        render(&scene, &settings, &|_, _| std::ops::ControlFlow::Continue(()))
    else {
        panic!()
    };
    let dt = t.elapsed().as_secs_f64();
    let image = film.develop();
    let mut h = 0xcbf29ce484222325u64;
    for p in &image.pixels {
        for c in p {
            h = (h ^ c.to_bits() as u64).wrapping_mul(0x100000001b3);
        }
    }
    println!("{level} {dt:.3}s {:.1} M samples/s hash {h:016x} {stats:?}", stats.shadow_rays as f64 / dt / 1e6);
    if let Some(f) = args.get(4) {
        let mut o = format!("P6\n{size} {size}\n255\n").into_bytes();
        for p in &image.pixels {
            for c in &p[..3] {
                o.push((c.clamp(0., 1.) as f64).powf(1. / 2.2).mul_add(255., 0.5) as u8);
            }
        }
        std::fs::write(f, o).unwrap();
    }
}
