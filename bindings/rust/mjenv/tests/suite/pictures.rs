//! Compares pictures with Gymnasium's, which tests/pictures/record draws on the same machine.

use std::fs;
use std::path::Path;
use std::thread;

use mjenv::{Camera, Env, ErrorKind, Image, Options, RenderSettings, Renderer};

fn ready(id: &str, rows: usize) -> Env {
    let mut env = Env::new(&Options::new(id).unwrap(), rows).unwrap();
    env.seed(.., &(0..rows as u64).map(|row| 8 + row).collect::<Vec<_>>()).unwrap();
    let mut batch = env.batch::<f64>();
    env.reset(.., &mut batch).unwrap();
    env
}

fn small(env: &Env) -> RenderSettings {
    env.render_settings().size(33, 21)
}

fn assert_recorded(id: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../build/pictures").join(id);
    let file = fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}; run tests/pictures/record", path.display()));
    let end = file.iter().position(|&byte| byte == b'\n').unwrap();
    let header = std::str::from_utf8(&file[..end]).unwrap().split(' ').skip(1);
    let numbers: Vec<usize> = header.map(|number| number.parse().unwrap()).collect();
    let (seed, width, height, steps) = match numbers[..] {
        [seed, width, height, steps] => (seed, width, height, steps),
        _ => panic!("{numbers:?}"),
    };
    let (rgb, depth) = file[end + 1..].split_at(3 * width * height);

    let mut env = Env::new(&Options::new(id).unwrap(), 1).unwrap();
    let mut batch = env.batch::<f64>();
    env.seed(.., &[seed as u64]).unwrap();
    env.reset(.., &mut batch).unwrap();
    let action = vec![0.0f32; env.action_space().count()];
    for _ in 0..steps {
        env.step(.., &action, &mut batch).unwrap();
    }
    let mut renderer = Renderer::new(&env, &env.render_settings().size(width, height)).unwrap();
    let (colours, depths) = renderer.render_both(0).unwrap();
    assert_eq!((colours.width(), colours.height()), (width, height));
    assert_eq!(colours.get(0, 1), [rgb[3 * width], rgb[3 * width + 1], rgb[3 * width + 2]]);
    assert!(colours.clone().into_bytes() == rgb);
    let bits = depths.pixels().iter().flat_map(|depth| depth.to_le_bytes());
    assert!(bits.eq(depth.iter().copied()));
    assert!(renderer.render(0).unwrap() == colours);
    assert!(renderer.render_depth(0).unwrap() == depths);
    // Each pixel shows a geom (mjOBJ_GEOM) of the model, or nothing.
    let objects = renderer.render_segmentation(0).unwrap();
    let geoms = i32::try_from(env.object_count("geom").unwrap()).unwrap();
    assert!(objects.pixels().iter().all(|&[index, kind]| kind == 5 && index < geoms || [index, kind] == [-1, -1]));
    assert!(objects.pixels().iter().any(|&[index, _]| index > 0));
}

#[test]
fn pictures_are_gymnasiums() {
    assert_recorded("Ant-v5");
    assert_recorded("Reacher-v5");
}

#[test]
fn defaults_are_gymnasiums() {
    let settings = ready("Hopper-v5", 1).render_settings();
    assert_eq!((settings.width, settings.height, settings.max_geom, settings.samples), (480, 480, 1000, 4));
    assert_eq!((settings.lookat, settings.distance), (Some([0.0, 0.0, 1.15]), Some(3.0)));
    assert_eq!((settings.azimuth, settings.elevation), (None, Some(-20.0)));
    assert_eq!(ready("Pusher-v5", 1).render_settings().lookat, None);
}

#[test]
fn cameras_differ() {
    let env = ready("Walker2d-v5", 1);
    let draw = |settings: RenderSettings| Renderer::new(&env, &settings).unwrap().render(0).unwrap();
    let free = draw(small(&env));
    assert!(free == draw(small(&env).camera(Camera::Free)));
    let track = draw(small(&env).camera(Camera::Index(0)));
    assert!(track == draw(small(&env).camera(Camera::Name("track".to_owned()))));
    assert!(free != track);
    assert!(free != draw(small(&env).fast()));
}

#[test]
fn groups_are_chosen() {
    let env = ready("Walker2d-v5", 1);
    let draw = |settings: RenderSettings| Renderer::new(&env, &settings).unwrap().render(0).unwrap();
    let mut settings = small(&env);
    let by_default = [true, true, true, false, false, false];
    let others = [settings.sitegroup, settings.jointgroup, settings.tendongroup, settings.actuatorgroup];
    assert_eq!((settings.geomgroup, settings.skingroup, others), (by_default, by_default, [by_default; 4]));
    let shown = draw(settings.clone());
    // All geoms of the model are in group 0.
    settings.geomgroup[3] = true;
    assert!(shown == draw(settings.clone()));
    settings.geomgroup[0] = false;
    assert!(shown != draw(settings));
}

#[test]
fn rows_are_drawn_on_threads() {
    let env = ready("Hopper-v4", 3);
    let mut renderer = Renderer::new(&env, &small(&env)).unwrap();
    let alone: Vec<Image<[u8; 3]>> = (0..3).map(|row| renderer.render(row).unwrap()).collect();
    let renderers: Vec<Renderer> = (0..3).map(|_| Renderer::new(&env, &small(&env)).unwrap()).collect();
    let drawn: Vec<Image<[u8; 3]>> = thread::scope(|scope| {
        let threads: Vec<_> = renderers
            .into_iter()
            .enumerate()
            .map(|(row, mut own)| scope.spawn(move || own.render(row).unwrap()))
            .collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert!(drawn == alone);
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let env = ready("Ant-v4", 1);
    let status = |settings: RenderSettings| Renderer::new(&env, &settings).unwrap_err().kind();
    assert_eq!(status(small(&env).size(0, 5)), ErrorKind::Value);
    assert_eq!(status(small(&env).size(5, usize::MAX)), ErrorKind::Value);
    assert_eq!(status(small(&env).camera(Camera::Index(7))), ErrorKind::Value);
    assert_eq!(status(small(&env).camera(Camera::Index(-2))), ErrorKind::Value);
    assert_eq!(status(small(&env).camera(Camera::Name("front".to_owned()))), ErrorKind::Name);
    assert_eq!(status(small(&env).camera(Camera::Name("a\0b".to_owned()))), ErrorKind::Argument);
    let mut renderer = Renderer::new(&env, &small(&env)).unwrap();
    assert_eq!(renderer.render(1).unwrap_err().kind(), ErrorKind::Value);
    drop(env);
    assert_eq!(renderer.render(0).unwrap_err().kind(), ErrorKind::Argument);
}
