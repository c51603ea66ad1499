//! Pictures whose pixels have several gathering walks in a pass, some more than others.

use crate::support::{pictures, seed};
use nephroid::render::Options;
use nephroid::report::agreement::BlockSeries;
use nephroid::scene::Scene;
use nephroid::transport::sample_map::SampleMap;
use nephroid::transport::settings::{Settings, Techniques};
use std::sync::Arc;

/// Numbers that differ from cell to cell.
pub fn checkered() -> Arc<SampleMap> {
    Arc::new(SampleMap::from_rows(&[vec![1, 7, 2], vec![5, 1, 9], vec![1, 3, 1]]).unwrap())
}

/// Pictures of four passes by these joins.
pub fn drawn(world: &Scene, techniques: &str, samples: &Arc<SampleMap>, first: u64) -> BlockSeries {
    let techniques = Techniques::parse(techniques).unwrap();
    pictures(world, 32, |r| {
        let seed = seed() * 1000 + first + r;
        let settings = Settings { techniques, samples: samples.clone(), merge_radius: Some(0.05), seed, ..Settings::default() };
        Options { settings, ..Options::default() }
    })
}
