//! Cuts that grow while the body moves: when they are made, and the masses along them.

use cutis_mesh::TetMesh;
use cutis_mesh::sever::{Growth, Stage};

use crate::scene::Scene;

/// The cuts of a body that are made while it moves.
pub(crate) struct GrowingCuts {
    pub(crate) growth: Growth,
    /// When each blade cuts.
    times: Vec<Timing>,
    /// Mass in kg that each of [`Growth::nodes`] has from tets that no cut divides.
    whole: Vec<f64>,
    /// Mass in kg of each tet that the finished cuts divide, ascending by its number.
    tets: Vec<(u32, f64)>,
}

/// When a blade cuts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Timing {
    /// Start, s.
    at_s: f64,
    /// Speed along its path, m/s; none if it cuts at once.
    speed_m_s: Option<f64>,
}

impl Timing {
    /// The times of the cuts of no width of a scene, in the order of their blades.
    pub(super) fn all(scene: &Scene) -> Vec<Self> {
        let timing = |at_s: f64, speed_mm_s: Option<f64>| Self {
            at_s,
            speed_m_s: speed_mm_s.map(|speed| speed / 1000.0),
        };
        let incisions = scene.incision.iter().filter(|section| section.width_mm.is_none());
        let incisions = incisions.map(|section| timing(section.at_s, section.speed_mm_s));
        let underminings = scene.undermining.iter().map(|section| timing(section.at_s, section.speed_mm_s));
        // Two blades cut a piece out.
        let excisions = scene.excision.iter().flat_map(|section| [timing(section.at_s, None); 2]);
        incisions.chain(underminings).chain(excisions).collect()
    }

    /// Whether the cut is made while the body moves.
    pub(super) fn is_later(&self) -> bool {
        self.at_s > 0.0 || self.speed_m_s.is_some()
    }

    /// Length of the path in m that the blade has passed at a time in s, of `length` in all.
    fn reached(&self, time_s: f64, length: f64) -> f64 {
        match self.speed_m_s {
            _ if time_s < self.at_s => 0.0,
            None => length,
            Some(speed) => length.min(speed * (time_s - self.at_s)),
        }
    }
}

impl GrowingCuts {
    /// `times` are those of the blades. `mesh` is divided.
    pub(super) fn new(
        growth: Growth,
        times: Vec<Timing>,
        mesh: &TetMesh,
        density: &dyn Fn(f32) -> f32,
    ) -> Self {
        let masses = mesh.masses_of(0..mesh.whole_tets(), density);
        let whole = growth.nodes().iter().map(|&node| masses[node as usize]).collect();
        let uncut = growth.stage(&vec![0.0; growth.lengths().len()]);
        let mass = |copy: &cutis_mesh::sever::TetCopy| (copy.tet, mesh.tet_mass(&copy.nodes, density));
        let tets = uncut.tets.iter().map(mass).collect();
        Self { growth, times, whole, tets }
    }

    /// How far each blade has come at a time in s, in m along its path.
    pub(crate) fn reached(&self, time_s: f64) -> Vec<f64> {
        let blades = self.times.iter().zip(self.growth.lengths());
        blades.map(|(timing, length)| timing.reached(time_s, length)).collect()
    }

    /// Which blades have cut to their ends at a time in s. A piece is out when its blade has.
    pub(super) fn finished(&self, time_s: f64) -> Vec<bool> {
        self.reached(time_s).iter().zip(self.growth.lengths()).map(|(&reached, all)| reached >= all).collect()
    }

    /// Mass of each of [`Growth::nodes`] at a stage, kg. Nodes without elements have none.
    pub(crate) fn masses(&self, stage: &Stage) -> Vec<f64> {
        let nodes = self.growth.nodes();
        let place = |node: u32| nodes.partition_point(|&other| other < node);
        let mut masses = self.whole.clone();
        for copy in &stage.tets {
            let tet = self.tets.partition_point(|(tet, _)| *tet < copy.tet);
            let quarter = self.tets[tet].1 * f64::from(copy.share) / 4.0;
            copy.nodes.iter().for_each(|&node| masses[place(node)] += quarter);
        }
        masses
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blade_begins_at_its_time_and_moves_at_its_speed() {
        let at_once = Timing { at_s: 0.5, speed_m_s: None };
        let slowly = Timing { at_s: 0.5, speed_m_s: Some(0.02) };
        for (time, [once, slow]) in
            [(0.4, [0.0; 2]), (0.5, [0.08, 0.0]), (1.5, [0.08, 0.02]), (9.0, [0.08, 0.08])]
        {
            assert_eq!(at_once.reached(time, 0.08), once, "{time}");
            assert_eq!(slowly.reached(time, 0.08), slow, "{time}");
        }
    }
}
