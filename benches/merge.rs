//! Merging one unit of 64 x 64 pixels into its tile: 400 channels are 6.5 MB read, as many written.

use criterion::{Criterion, criterion_group, criterion_main};
use serde_json::Map;
use spectile::cube::{Existing, Header, Writer};
use spectile::spectral::Channels;

fn merge(criterion: &mut Criterion) {
    let folder = tempfile::tempdir().expect("temporary folder");
    for channels in [30, 400, 2000] {
        let header = Header {
            size: [64, 64],
            origin: [0, 0],
            tile: [64, 64],
            channels: Channels::equal(380.0, 780.0, channels),
            epoch: 1,
            attributes: Map::new(),
        };
        let path = folder.path().join(format!("{channels}.zarr"));
        let cube = Writer::open(&path, &header, Existing::Refuse, 0..1, &mut |what| panic!("{what}")).expect("cube");
        let unit: Vec<f32> = (0..64 * 64 * channels).map(|i| (i % 1009) as f32).collect();
        let mut samples = 0;
        let mut merge = || {
            cube.merge_unit(0, samples, 1, &unit).expect("merged");
            samples += 1;
        };
        merge();
        criterion.bench_function(&format!("merge 64x64x{channels}"), |bencher| bencher.iter(&mut merge));
        cube.flush().expect("committed");
        criterion.bench_function(&format!("merge and commit 64x64x{channels}"), |bencher| {
            bencher.iter(|| {
                merge();
                cube.flush().expect("committed");
            });
        });
    }
}

criterion_group!(benches, merge);
criterion_main!(benches);
