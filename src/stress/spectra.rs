//! Spectra and channels that are hard to hold: lines, long and short tables, channels of any width and number.

use super::bench::{F32, TABLES, WALL, lamp};
use super::{Bench, Case};
use crate::Result;
use crate::device::rng::hash;
use crate::spectral::planck;

const GROUP: &str = "spectra";

pub const CASES: &[Case] = &[
    Case {
        group: GROUP,
        name: "line",
        what: "a line of 0.01 nm in a channel of 10 nm, seen directly and by light from a white wall: its area over the width",
        run: line,
    },
    Case {
        group: GROUP,
        name: "long-table",
        what: "10,001 nodes in 8 channels: trapezia between the nodes",
        run: long_table,
    },
    Case { group: GROUP, name: "two-nodes", what: "a table of two nodes: the value at each centre", run: two_nodes },
    Case {
        group: GROUP,
        name: "widths",
        what: "channels 0.001 nm and 10,000 nm wide in one cube: Planck's law at 1000 K, and its mean by Simpson's rule",
        run: widths,
    },
    Case {
        group: GROUP,
        name: "overlaps",
        what: "disjoint, overlapping and equal channels: linear radiance at each centre, equal bits in equal channels",
        run: overlaps,
    },
    Case {
        group: GROUP,
        name: "counts",
        what: "1, 2, 3, 2,000 and 5,000 channels: a visible constant to the last bit",
        run: counts,
    },
    Case {
        group: GROUP,
        name: "outside",
        what: "channels partly and wholly outside the data: zero there",
        run: outside,
    },
];

fn line(bench: &mut Bench) -> Result<()> {
    const LINE: &str = "{ samples = [[549.995, 0], [550, 1000], [550.005, 0]] }";
    let expected = 0.5 * 0.01 * 1000.0 / 10.0;
    let seen = bench.render(&(lamp(LINE) + "[channels]\nintervals = [[545, 555], [540, 560]]\n"), 1024)?;
    bench.check("seen directly, 10 nm", expected, seen.of(0), 1e-5);
    bench.check("seen directly, 20 nm", 0.5 * expected, seen.of(1), 1e-5);
    bench.check_within("noise of the mean", 0.0, (seen.error[0] / expected, 0.0), 0.02);
    // A wall of reflectance 0.5 under a sky of the line.
    let wall = format!(
        "[channels]\nintervals = [[545, 555]]\n[integrator]\nmax_bounces = 1\n[materials.grey.diffuse]\nreflectance = 0.5\n\
         [environment]\nradiance = {LINE}\n[[objects]]\n{WALL}\
         material = \"grey\"\n"
    );
    let reflected = bench.render(&wall, 1024)?;
    bench.check("from a wall", 0.5 * expected, reflected.of(0), TABLES);
    Ok(())
}

fn long_table(bench: &mut Bench) -> Result<()> {
    let values: Vec<f64> = (0..=10_000).map(|i| f64::from(hash(i) >> 8) / 16_777_216.0).collect();
    let list: Vec<String> = values.iter().map(|v| format!("{v:.9}")).collect();
    let radiance = format!("{{ regular = {{ from = 400, to = 800, values = [{}] }} }}", list.join(", "));
    let seen = bench.render(&(lamp(&radiance) + "[channels]\nequal = { from = 400, to = 800, count = 8 }\n"), 4096)?;
    let mean = |k: usize| {
        let part = &values[1250 * k..=1250 * (k + 1)];
        part.windows(2).map(|w| 0.5 * (w[0] + w[1])).sum::<f64>() / 1250.0
    };
    let expected: Vec<f64> = (0..8).map(mean).collect();
    bench.check_all("mean", &expected, &seen, 1e-5);
    Ok(())
}

fn two_nodes(bench: &mut Bench) -> Result<()> {
    let text = lamp("{ samples = [[400, 1], [800, 3]] }") + "[channels]\nequal = { from = 400, to = 800, count = 5 }\n";
    let seen = bench.render(&text, 1024)?;
    let expected: Vec<f64> = (0..5).map(|k| 1.0 + 2.0 * (f64::from(k) + 0.5) / 5.0).collect();
    bench.check_all("mean", &expected, &seen, F32);
    Ok(())
}

fn widths(bench: &mut Bench) -> Result<()> {
    let text = lamp("{ blackbody = 1000 }") + "[channels]\nintervals = [[2000, 2000.001], [5000, 15000]]\n";
    let seen = bench.render(&text, 4096)?;
    let law = |nm: f64| planck::radiance(nm, 1000.0);
    bench.check("0.001 nm", law(2000.0005), seen.of(0), 1e-5);
    const PIECES: u32 = 20_000;
    let h = 10_000.0 / f64::from(PIECES);
    let weight = |i: u32| {
        if i == 0 || i == PIECES {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        }
    };
    let sum: f64 = (0..=PIECES).map(|i| weight(i) * law(5000.0 + h * f64::from(i))).sum();
    bench.check("10,000 nm", sum * h / 3.0 / 10_000.0, seen.of(1), 1e-5);
    Ok(())
}

fn overlaps(bench: &mut Bench) -> Result<()> {
    let text = lamp("{ samples = [[400, 1], [800, 3]] }")
        + "[channels]\nintervals = [[400, 500], [450, 460], [700, 800], [400, 500]]\n";
    let seen = bench.render(&text, 1024)?;
    bench.check_all("mean", &[1.25, 1.275, 2.75, 1.25], &seen, F32);
    bench.check_within("equal channels differ by", 0.0, (seen.mean[0] - seen.mean[3], 0.0), 0.0);
    Ok(())
}

fn counts(bench: &mut Bench) -> Result<()> {
    for count in [1, 2, 3, 2000, 5000] {
        let text = format!("{}[channels]\nequal = {{ from = 400, to = 800, count = {count} }}\n", lamp("0.7"));
        let seen = bench.render(&text, 16)?;
        let wrong = seen.image.mean.iter().filter(|v| **v != f64::from(0.7f32)).count();
        bench.check_within(format!("values of {count} channels that are not 0.7"), 0.0, (wrong as f64, 0.0), 0.0);
    }
    Ok(())
}

fn outside(bench: &mut Bench) -> Result<()> {
    let text =
        lamp("{ samples = [[500, 1], [600, 1]] }") + "[channels]\nintervals = [[400, 450], [550, 650], [650, 700]]\n";
    let seen = bench.render(&text, 4096)?;
    for (k, expected) in [0.0, 0.5, 0.0].into_iter().enumerate() {
        bench.check(format!("channel {k}"), expected, seen.of(k), 1e-5);
    }
    Ok(())
}
