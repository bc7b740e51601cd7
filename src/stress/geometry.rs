//! Scales, places and shapes at their ends.

use std::f64::consts::PI;

use super::bench::{F32, TABLES};
use super::{Bench, Case};
use crate::{Error, Result};

const GROUP: &str = "geometry";

pub const CASES: &[Case] = &[
    Case {
        group: GROUP,
        name: "scales",
        what: "a glowing room of 1e-6 to 1e6 m, and moved 1e6 of its sides away: Σ ρ^i to the bounces",
        run: scales,
    },
    Case {
        group: GROUP,
        name: "slivers",
        what: "lamps in one place and slivers of 1e-9 before a lamp: its radiance, once",
        run: slivers,
    },
    Case {
        group: GROUP,
        name: "pile",
        what: "a million triangles in one point before a lamp, and ten thousand of 1e-30 m: its radiance; a thousand in one place: theirs; more than a ray can test: each ray says so",
        run: pile,
    },
    Case { group: GROUP, name: "nothing", what: "no object at all: the sky, exactly", run: nothing },
    Case {
        group: GROUP,
        name: "lights",
        what: "a square lamp of 1e-12 and of 1e6 m² over a patch: the form factor of a rectangle",
        run: lights,
    },
    Case {
        group: GROUP,
        name: "camera-on-surface",
        what: "a camera in the plane of a wall, looking away: the sky, exactly",
        run: camera_on_surface,
    },
    Case {
        group: GROUP,
        name: "watertight",
        what: "1e7 camera rays in a closed room of triangles under a sky of 1e6: nothing gets in",
        run: watertight,
    },
    Case {
        group: GROUP,
        name: "corners",
        what: "1e7 scattered rays in a closed room under a sky of 1e6, where rounding must not put what a ray meets beyond the next wall",
        run: corners,
    },
];

/// A cube of side 2 `scale` about `x` along the first axis.
fn room(scale: f64, x: f64, reflectance: f64, emission: f64, bounces: u32) -> String {
    let [low, high] =
        [-1.0, 1.0].map(|side| format!("[{:.17e}, {:.17e}, {:.17e}]", x + side * scale, side * scale, side * scale));
    let emission =
        if emission > 0.0 { format!("emission = {emission}\nemission_sides = \"both\"\n") } else { String::new() };
    format!(
        "[camera.perspective]\nposition = [{:.17e}, {:e}, {:e}]\nlook_at = [{:.17e}, 0, {:e}]\nup = [0, 1, 0]\nfov = 100\n\
         [integrator]\nmax_bounces = {bounces}\n[materials.wall.diffuse]\nreflectance = {reflectance}\n\
         [[objects]]\ncube = {{ min = {low}, max = {high} }}\nmaterial = \"wall\"\n{emission}",
        x + 0.1 * scale,
        0.2 * scale,
        0.3 * scale,
        x,
        -scale
    )
}

fn scales(bench: &mut Bench) -> Result<()> {
    let expected = (0..=8).map(|i| 0.5f64.powi(i)).sum();
    for (scale, x) in [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6), (1e-6, 1.0), (1e6, 1e12)] {
        let seen = bench.render(&room(scale, x, 0.5, 1.0, 8), 256)?;
        // Rays start off the surface by some roundings of the room's size, and miss as much of a corner.
        bench.check(format!("side {:e} m, {x:e} m away", 2.0 * scale), expected, seen.of(0), TABLES);
    }
    Ok(())
}

fn slivers(bench: &mut Bench) -> Result<()> {
    let lamp = "[[objects]]\nquad = { corner = [-1, -1, 0], edge_u = [2, 0, 0], edge_v = [0, 2, 0] }\nmaterial = \"b\"\nemission = 1\n";
    let head = "[integrator]\nmax_bounces = 0\n[materials.b.black]\n";
    let seen = bench.render(&format!("{head}{lamp}{lamp}{lamp}"), 256)?;
    bench.check_within("three lamps in one place", 1.0, seen.of(0), 0.0);
    // A hundred slivers, of which a ray in ten million meets one.
    let sliver = |i: i32| {
        format!(
            "[[objects]]\nquad = {{ corner = [-1, {:e}, 0.1], edge_u = [2, 0, 0], edge_v = [0, 1e-13, 0] }}\nmaterial = \"b\"\n",
            f64::from(i) * 1e-5
        )
    };
    let slivers: String = (-50..50).map(sliver).collect();
    let seen = bench.render(&format!("{head}{lamp}{slivers}"), 1024)?;
    bench.check("behind slivers of 1e-13", 1.0, seen.of(0), F32);
    Ok(())
}

/// A lamp that fills the view, in the same OBJ file as `count` equal triangles before it: what is seen, and rays that found no end.
fn piled(bench: &mut Bench, corners: [[f64; 3]; 3], count: usize, samples: u32) -> Result<(f64, u64)> {
    let folder = tempfile::tempdir().map_err(|error| Error::storage(&std::env::temp_dir(), error))?;
    let file = folder.path().join("pile.obj");
    let lamp = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let mut text: String = lamp.iter().chain(&corners).map(|[x, y, z]| format!("v {x:e} {y:e} {z:e}\n")).collect();
    text += "f 1 2 3\nf 1 3 4\n";
    text += &"f 5 6 7\n".repeat(count);
    std::fs::write(&file, text).map_err(|error| Error::storage(&file, error))?;
    let scene = format!(
        "[integrator]\nmax_bounces = 0\n[materials.b.black]\n[[objects]]\nmesh = {:?}\nmaterial = \"b\"\nemission = 1\n",
        file.display().to_string()
    );
    let before = bench.outcome.overflow;
    let seen = bench.render(&scene, samples)?;
    let unended = std::mem::replace(&mut bench.outcome.overflow, before) - before;
    Ok((seen.mean[0], unended))
}

fn pile(bench: &mut Bench) -> Result<()> {
    let point = [[0.0, 0.0, 0.5]; 3];
    let speck = [[0.0, 0.0, 0.5], [1e-30, 0.0, 0.5], [0.0, 1e-30, 0.5]];
    let wall = [[-1.0, -1.0, 0.5], [1.0, -1.0, 0.5], [1.0, 2.0, 0.5]];
    for (what, corners, count) in [
        ("a million in a point", point, 1_000_000),
        ("1e-30 m", speck, 10_000),
        ("a thousand in one place", wall, 1000),
    ] {
        let (mean, unended) = piled(bench, corners, count, 4)?;
        bench.check_within(format!("{what}: radiance"), 1.0, (mean, 0.0), 0.0);
        bench.check_within(format!("{what}: rays that did not end"), 0.0, (unended as f64, 0.0), 0.0);
    }
    // Beyond what one invocation may loop (32,768 times): no answer, and every one of 64 rays says that there is none.
    let (_, unended) = piled(bench, wall, 40_000, 1)?;
    bench.check_within("40,000 in one place: rays that say so", 64.0, (unended as f64, 0.0), 0.0);
    Ok(())
}

fn nothing(bench: &mut Bench) -> Result<()> {
    let seen = bench.render("[environment]\nradiance = 0.3\n", 256)?;
    bench.check_within("the sky", f64::from(0.3f32), seen.of(0), 0.0);
    let seen = bench.render("", 64)?;
    bench.check_within("and without a sky", 0.0, seen.of(0), 0.0);
    Ok(())
}

fn lights(bench: &mut Bench) -> Result<()> {
    for side in [1e-6f64, 1e-3, 2.0, 1e3] {
        let half = 0.5 * side;
        // So that the patch sends about 1.
        let radiance = 1.0 + 1.0 / (side * side);
        let text = format!(
            "[camera.orthographic]\nposition = [0, 0.5, 0.5]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]\nwidth = 1e-6\n\
             [integrator]\nmax_bounces = 1\n[materials.grey.diffuse]\nreflectance = 0.5\n[materials.b.black]\n\
             [[objects]]\nquad = {{ corner = [-1, 0, 1], edge_u = [2, 0, 0], edge_v = [0, 0, -2] }}\nmaterial = \"grey\"\n\
             [[objects]]\nquad = {{ corner = [{:e}, 1, {:e}], edge_u = [{side:e}, 0, 0], edge_v = [0, 0, {side:e}] }}\n\
             material = \"b\"\nemission = {radiance:e}\n",
            -half, -half
        );
        let seen = bench.render(&text, 4096)?;
        // Four corners of a rectangle a x a above a patch (docs/METHOD.md, Closed forms).
        let root = (1.0 + half * half).sqrt();
        let corner = (2.0 * half / root * (half / root).atan()) / (2.0 * PI);
        bench.check(format!("{:e} m²", side * side), 0.5 * radiance * 4.0 * corner, seen.of(0), TABLES);
    }
    Ok(())
}

fn camera_on_surface(bench: &mut Bench) -> Result<()> {
    let text = "[camera.perspective]\nposition = [0, 0, 0]\nlook_at = [0, 1, 0]\nup = [0, 0, 1]\nfov = 90\n\
                [integrator]\nmax_bounces = 0\n[environment]\nradiance = 1\n[materials.b.black]\n\
                [[objects]]\nquad = { corner = [-1, 0, 1], edge_u = [2, 0, 0], edge_v = [0, 0, -2] }\nmaterial = \"b\"\n";
    let seen = bench.render(text, 256)?;
    bench.check_within("the sky", 1.0, seen.of(0), 0.0);
    Ok(())
}

fn watertight(bench: &mut Bench) -> Result<()> {
    let sky = "[environment]\nradiance = 1e6\n[film]\nwidth = 64\nheight = 64\n";
    // Out of sight, and more triangles than rays test one by one.
    let beside = |i: usize| {
        format!("[[objects]]\ncube = {{ min = [{i}, 2, 2], max = [{i}.5, 2.5, 2.5] }}\nmaterial = \"wall\"\n")
    };
    let beside: String = (0..5).map(beside).collect();
    for (what, x, more) in
        [("a room of 2 m", 0.0, ""), ("the same 1e3 m away", 1e3, ""), ("one among others", 0.0, &beside)]
    {
        // 64 x 64 pixels x 1,280 samples.
        let seen = bench.render(&(room(1.0, x, 0.9, 0.0, 0) + sky + more), 1280)?;
        bench.check_within(what, 0.0, (seen.mean[0], 0.0), 0.0);
    }
    Ok(())
}

fn corners(bench: &mut Bench) -> Result<()> {
    let sky = "[film]\nwidth = 32\nheight = 32\n[environment]\nradiance = 1e6\n";
    for (what, scale, x) in [("a room of 2 m", 1.0, 0.0), ("one of 20 m, 300 m away", 10.0, 300.0)] {
        // 32 x 32 pixels x 512 samples x 10 rays.
        let seen = bench.render(&(room(scale, x, 0.9, 0.0, 9) + sky), 512)?;
        bench.check_within(format!("{what}: what gets in"), 0.0, (seen.mean[0], 0.0), 0.0);
    }
    Ok(())
}
