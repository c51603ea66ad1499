//! Some of the lights alone: emission is a sum, and so is what it lights.

use super::choice::Choice;
use super::{Emitter, Lights};
use crate::scene::EmitterId;

impl Lights {
    /// These emitters as they are, the others dark.
    pub fn only(&self, kept: &[EmitterId]) -> Self {
        let mut lights = self.clone();
        let mut on = vec![false; lights.emitters.len()];
        kept.iter().for_each(|id| on[id.0 as usize] = true);
        lights.skies.retain(|id| on[id.0 as usize]);
        lights.ambient.retain(|(id, _)| on[id.0 as usize]);
        for ((emitter, info), on) in lights.emitters.iter_mut().zip(&mut lights.infos).zip(on) {
            if !on {
                (*emitter, info.power) = (Emitter::Dark, [0.0; 3]);
            }
        }
        lights.choose();
        lights
    }

    /// The strongest emitters, `most − 1` at most, each on its own, and all others together; those that are
    /// dark are in none.
    pub fn apart(&self, most: usize) -> Vec<Vec<EmitterId>> {
        let power = |i: &usize| self.infos[*i].power.iter().sum::<f32>();
        let lit = |i: &usize| !matches!(self.emitters[*i], Emitter::Dark);
        let mut order: Vec<usize> = (0..self.emitters.len()).filter(lit).collect();
        order.sort_by(|a, b| power(b).total_cmp(&power(a)).then(a.cmp(b)));
        let ids = |of: &[usize]| of.iter().map(|i| EmitterId(*i as u32)).collect();
        let alone = if order.len() > most { most - 1 } else { order.len() };
        let rest = Some(&order[alone..]).filter(|r| !r.is_empty()).map(ids);
        order[..alone].iter().map(|i| ids(&[*i])).chain(rest).collect()
    }

    /// Decides how often each emitter is chosen, by their powers.
    pub(super) fn choose(&mut self) {
        let power = |(emitter, info): (&Emitter, &super::EmitterInfo)| match emitter {
            Emitter::Dark => 0.0,
            _ => info.power.iter().map(|p| f64::from(*p)).sum::<f64>() / 3.0,
        };
        let powers: Vec<f64> = self.emitters.iter().zip(&self.infos).map(power).collect();
        self.choice = Choice::new(&powers, self.p_across, |i| self.bound(i, powers[i]));
        for (i, info) in self.infos.iter_mut().enumerate() {
            info.prob_next_event = self.choice.as_ref().map_or(0.0, |c| c.next_event.prob_anywhere(i));
            info.prob_emission = self.choice.as_ref().map_or(0.0, |c| c.emission.prob(i));
        }
    }
}
