//! Lamps seen directly: hits and splats divide the light points among them, and none counts twice.

use crate::lights::{lights, of};
use nephroid::render::Estimator;
use nephroid::report::agreement::{BlockSeries, agreement};

fn noise(series: &BlockSeries) -> f64 {
    let n = series.draws.len() as f64;
    let mean = |b: usize| series.draws.iter().map(|d| d[b]).sum::<f64>() / n;
    let of_block = |b: usize| series.draws.iter().map(|d| (d[b] - mean(b)).powi(2)).sum::<f64>();
    (0..series.draws[0].len()).map(of_block).sum()
}

/// Both walkers together see what each sees alone, with a fraction of the noise of hits.
#[test]
fn lamps_are_divided_between_hits_and_splats() {
    for aperture in [true, false] {
        let world = lights(aperture);
        let hits = of(&world, Estimator::Gather, 1, 0);
        let splats = of(&world, Estimator::Shoot, 1, 100);
        // Without an aperture lamps are smaller than a pixel, and few samples decide: by the seed .08 to .21 with one sample
        // of chains, .006 to .013 with four.
        let most = if aperture { [0.15, 0.02] } else { [0.2, 0.05] };
        for (i, (chain_samples, most)) in [1, 4].into_iter().zip(most).enumerate() {
            let both = of(&world, Estimator::Bidirectional, chain_samples, 200 + 100 * i as u64);
            for (other, name) in [(&hits, "hits"), (&splats, "splats")] {
                let found = agreement(other, &both);
                assert!(found.energy_tested > 0.6, "{name}: {found:?}");
                assert!(found.p > 1e-5, "{name}, aperture {aperture}, {chain_samples} samples of chains: {found:?}");
            }
            let ratio = noise(&both) / noise(&hits);
            println!("aperture {aperture}: {ratio:.3} of the noise of hits");
            assert!(ratio < most, "aperture {aperture}, {chain_samples} samples of chains: {ratio} of the noise of hits");
        }
    }
}
