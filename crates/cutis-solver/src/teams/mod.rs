//! Teams: vertices of one color whose constraints have the same form.
//!
//! In a lattice, most vertices of a color have the same constraints, but with other neighbors. Up
//! to sixteen such vertices are a team, one per SIMD lane. Vertex block descent reads the positions
//! around a team once for all kinds of constraints. The parameters of its constraints follow each
//! other in memory, in the order in which they are read. Teams are found in the constraints,
//! without knowledge of a lattice. They change no result.

mod forms;

use cutis_coloring::{Groups, Incidence};
use cutis_constraints::Scalar;

use self::forms::{Forms, Pattern};
use crate::{Kind, Values};

/// Largest number of vertices of a team.
pub(crate) const TEAM: usize = 16;

/// Smallest number of vertices of a team. Fewer vertices of one form are in no team, because a team
/// takes the memory and time of sixteen vertices.
const LEAST: usize = 4;

/// Largest number of vertices in a neighborhood.
pub(crate) const MOST_NEIGHBORS: usize = 32;

/// Number of teams that a thread takes at a time. Results do not depend on it.
pub(crate) const TEAM_CHUNK: usize = if cfg!(miri) { 1 } else { 8 };

/// Coordinates of the vertices around a team: for each neighbor x, y and z of all vertices.
pub(crate) type Neighborhood<T> = [[[T; TEAM]; 3]; MOST_NEIGHBORS];

/// The teams of a system.
#[derive(Clone, Debug)]
pub(crate) struct Teams<T> {
    /// For each vertex: 0, or 1 + the number of its team.
    team_of: Vec<u32>,
    teams: Vec<Team>,
    /// For each neighbor of a team its vertex for each lane. Excess lanes repeat the last vertex.
    neighbors: Vec<[u32; TEAM]>,
    patterns: Vec<Pattern>,
    tables: Vec<Table<T>>,
    /// Start of the teams of each color, and the end of the last one.
    colors: Vec<u32>,
    /// The vertices of each color that are in no team, in the order of the groups.
    others: Vec<Vec<u32>>,
}

/// Vertices of one pattern.
#[derive(Clone, Copy, Debug)]
struct Team {
    /// Number of vertices. 0 if the team is dissolved.
    count: u32,
    pattern: u32,
    /// Start in `Teams::neighbors`.
    neighbors: u32,
}

/// The parameters of the constraints of one kind, team by team.
#[derive(Clone, Debug)]
struct Table<T> {
    /// Start of each team in `numbers`.
    starts: Vec<u32>,
    /// For each constraint of a team: its parameters, and its stiffness if the constraints of the
    /// kind have different ones. One number per lane.
    numbers: Vec<[T; TEAM]>,
}

/// The constraints of one kind at the vertices of a team.
pub struct TeamConstraints<'a, T> {
    /// Number of vertices.
    pub(crate) count: usize,
    /// The entries of the pattern.
    pub(crate) entries: &'a [u8],
    /// The numbers of the team, and maybe more.
    pub(crate) numbers: &'a [[T; TEAM]],
    /// Positions of the vertices.
    pub(crate) neighborhood: &'a Neighborhood<T>,
}

impl<T> Default for Teams<T> {
    /// No teams, for solvers that do not use them.
    fn default() -> Self {
        Self {
            team_of: Vec::new(),
            teams: Vec::new(),
            neighbors: Vec::new(),
            patterns: Vec::new(),
            tables: Vec::new(),
            colors: Vec::new(),
            others: Vec::new(),
        }
    }
}

impl<T: Scalar> Teams<T> {
    /// Finds the teams of each group. `incidences` are those of `kinds`, for `vertices` vertices.
    pub(crate) fn find(
        vertices: usize,
        groups: &Groups,
        kinds: &[Kind<T>],
        incidences: &[Incidence],
    ) -> Self {
        let table = |_: &Kind<T>| Table { starts: Vec::new(), numbers: Vec::new() };
        let mut found = Self {
            team_of: vec![0; vertices],
            tables: kinds.iter().map(table).collect(),
            colors: vec![0],
            ..Self::default()
        };
        let mut forms = Forms::default();
        for color in groups.offsets.windows(2) {
            forms.find(&groups.order[color[0] as usize..color[1] as usize], kinds, incidences);
            for pattern in 0..forms.of_pattern.len() {
                for places in forms.of_pattern[pattern].chunks(TEAM).filter(|places| places.len() >= LEAST) {
                    found.add(pattern as u32, places, &forms, kinds, incidences);
                }
            }
            found.colors.push(found.teams.len() as u32);
        }
        found.patterns = forms.patterns;
        found.regroup(groups);
        found
    }

    /// Adds a team of the vertices with some places in `forms`.
    fn add(
        &mut self,
        pattern: u32,
        places: &[u32],
        forms: &Forms,
        kinds: &[Kind<T>],
        incidences: &[Incidence],
    ) {
        let lanes: [usize; TEAM] = std::array::from_fn(|lane| places[lane.min(places.len() - 1)] as usize);
        let (count, neighbors) = (places.len() as u32, self.neighbors.len() as u32);
        let around = lanes.map(|place| forms.neighbors(place));
        self.neighbors.extend((0..around[0].len()).map(|n| around.map(|neighbors| neighbors[n])));
        self.teams.push(Team { count, pattern, neighbors });
        let vertices = around.map(|neighbors| neighbors[0]);
        vertices.iter().for_each(|&vertex| self.team_of[vertex as usize] = self.teams.len() as u32);
        for ((kind, incidence), table) in kinds.iter().zip(incidences).zip(&mut self.tables) {
            table.starts.push(table.numbers.len() as u32);
            let (arity, params, count) = (kind.arity(), kind.params(), kind.param_count());
            let own = vertices.map(|vertex| incidence.of(vertex));
            for entry in 0..own[0].len() {
                let constraints = own.map(|places| places[entry] as usize / arity);
                table.numbers.extend((0..count).map(|j| constraints.map(|k| params[k * count + j])));
                if let Values::Each(compliances) = kind.stiffness().values() {
                    table.numbers.push(constraints.map(|k| T::one() / compliances[k]));
                }
            }
        }
    }

    /// Dissolves the teams of some vertices, whose constraints change. Call
    /// [`regroup`](Self::regroup) afterwards.
    pub(crate) fn dissolve(&mut self, vertices: impl Iterator<Item = u32>) {
        for vertex in vertices {
            if let Some(team) = self.team_of.get(vertex as usize).and_then(|team| team.checked_sub(1)) {
                self.teams[team as usize].count = 0;
            }
        }
    }

    /// Follows a change of the groups. A team whose vertices are no longer all in its color is
    /// dissolved.
    pub(crate) fn regroup(&mut self, groups: &Groups) {
        if self.colors.is_empty() {
            return;
        }
        let mut present = vec![0; self.teams.len()];
        let colors =
            || groups.offsets.windows(2).map(|color| color[0] as usize..color[1] as usize).enumerate();
        for (color, range) in colors() {
            let own = self.range(color);
            for &vertex in &groups.order[range] {
                if let Some(team) = (self.team_of[vertex as usize] as usize).checked_sub(1)
                    && own.contains(&team)
                {
                    present[team] += 1;
                }
            }
        }
        for (team, &present) in self.teams.iter_mut().zip(&present) {
            team.count = if team.count == present { present } else { 0 };
        }
        let alone = |vertex: &u32| {
            let team = (self.team_of[*vertex as usize] as usize).checked_sub(1);
            team.is_none_or(|team| self.teams[team].count == 0)
        };
        self.others =
            colors().map(|(_, range)| groups.order[range].iter().copied().filter(alone).collect()).collect();
    }

    /// The numbers of the teams of a color. Some may be dissolved.
    pub(crate) fn range(&self, color: usize) -> std::ops::Range<usize> {
        match self.colors.get(color..color.saturating_add(2)) {
            Some(&[start, end]) => start as usize..end as usize,
            _ => 0..0,
        }
    }

    /// The vertices of a color that are in no team. `None` if teams were not looked for.
    pub(crate) fn others(&self, color: usize) -> Option<&[u32]> {
        self.others.get(color).map(Vec::as_slice)
    }

    /// Number of vertices of a team, and the vertices around it, those of the team first. `None` if
    /// it is dissolved.
    pub(crate) fn neighbors(&self, team: usize) -> Option<(usize, &[[u32; TEAM]])> {
        let Team { count, pattern, neighbors } = self.teams[team];
        let end = neighbors as usize + self.patterns[pattern as usize].neighbors;
        (count > 0).then(|| (count as usize, &self.neighbors[neighbors as usize..end]))
    }

    /// The constraints of one kind at the vertices of a team.
    pub(crate) fn constraints<'a>(
        &'a self,
        kind: usize,
        team: usize,
        neighborhood: &'a Neighborhood<T>,
    ) -> TeamConstraints<'a, T> {
        let Team { count, pattern, .. } = self.teams[team];
        let table = &self.tables[kind];
        let numbers = &table.numbers[table.starts[team] as usize..];
        let entries = &self.patterns[pattern as usize].entries[kind];
        TeamConstraints { count: count as usize, entries, numbers, neighborhood }
    }

    /// Memory in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let of_table =
            |table: &Table<T>| size_of_val(table.starts.as_slice()) + size_of_val(table.numbers.as_slice());
        size_of_val(self.team_of.as_slice())
            + size_of_val(self.teams.as_slice())
            + size_of_val(self.neighbors.as_slice())
            + self.tables.iter().map(of_table).sum::<usize>()
            + self.others.iter().map(|others| size_of_val(others.as_slice())).sum::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use cutis_constraints::{Distance, Volume};
    use nalgebra::Point3;

    use super::*;
    use crate::{Descent, Stiffness, System, SystemBuilder};

    fn teams_of(system: &System<f64>, colors: &[u16]) -> (Groups, Teams<f64>) {
        let groups = Groups::from_colors(colors).unwrap();
        let incidences = Descent::incidences_of(system).unwrap();
        let teams = Teams::find(colors.len(), &groups, system.kinds(), &incidences);
        (groups, teams)
    }

    /// A chain of 40 edges with the rest lengths 1, 2, … Every second vertex has one color.
    fn chain() -> (Groups, Teams<f64>) {
        let positions: Vec<Point3<f64>> = (0..41).map(|v| Point3::new(f64::from(v), 0.0, 0.0)).collect();
        let edges: Vec<[u32; 2]> = (0..40).map(|v| [v, v + 1]).collect();
        let groups = cutis_coloring::greedy(&edges, 41).unwrap();
        let params: Vec<[f64; 1]> = (0..40).map(|v| [1.0 + f64::from(v)]).collect();
        let builder = SystemBuilder::new(&positions, &[1.0; 41]).unwrap();
        let stiffness = Stiffness::compliance(1e-3);
        let system = builder.add::<Distance, 2>(&edges, &params, stiffness, &groups).unwrap().build();
        let colors: Vec<u16> = (0..41).map(|v| (v % 2) as u16).collect();
        teams_of(&system, &colors)
    }

    /// The vertices of the teams of a color.
    fn members(teams: &Teams<f64>, color: usize) -> Vec<Vec<u32>> {
        let found = teams.range(color).filter_map(|team| teams.neighbors(team));
        found.map(|(count, around)| around[0][..count].to_vec()).collect()
    }

    fn even(range: std::ops::RangeInclusive<u32>) -> Vec<u32> {
        range.step_by(2).collect()
    }

    #[test]
    fn vertices_with_constraints_of_one_form_are_a_team() {
        let (_, teams) = chain();
        assert_eq!(members(&teams, 0), [even(2..=32)]);
        // The first and the last vertex have one edge, and three vertices are too few for a team.
        assert_eq!(teams.others(0).unwrap(), [0, 34, 36, 38, 40]);
        assert_eq!(members(&teams, 1), [even(1..=31), even(33..=39)]);
        assert_eq!(teams.others(1).unwrap(), [0; 0]);
        assert_eq!(teams.others(2), None);
    }

    #[test]
    fn the_numbers_of_a_team_are_those_of_its_constraints() {
        let (_, teams) = chain();
        let neighborhood = [[[0.0; TEAM]; 3]; MOST_NEIGHBORS];
        let mut edges = 0;
        for team in teams.range(0).chain(teams.range(1)) {
            let (count, around) = teams.neighbors(team).unwrap();
            let constraints = teams.constraints(0, team, &neighborhood);
            for (entry, numbers) in constraints.entries.chunks_exact(3).zip(constraints.numbers) {
                assert_eq!(entry[1 + usize::from(entry[0])], 0, "the vertex itself");
                for lane in 0..count {
                    assert_eq!(numbers[lane], 1.0 + f64::from(around[usize::from(entry[1])][lane]));
                    edges += 1;
                }
            }
        }
        assert_eq!(edges, 2 * 36, "two edges at each vertex of a team");
    }

    #[test]
    fn most_vertices_of_a_lattice_are_in_teams() {
        let lattice = cutis_test_kit::Kuhn::new([48, 5, 5], 1.0);
        let groups = Groups::from_colors(&lattice.tet_colors).unwrap();
        let count = lattice.positions.len();
        let params = vec![[1.0 / 6.0]; lattice.tets.len()];
        let builder = SystemBuilder::new(&lattice.positions, &vec![1.0; count]).unwrap();
        let stiffness = Stiffness::compliance(1e-3);
        let system = builder.add::<Volume, 4>(&lattice.tets, &params, stiffness, &groups).unwrap().build();
        let sum = |p: &Point3<f64>| (p.x + p.y + p.z).round() as u16 % 4;
        let colors: Vec<u16> = lattice.positions.iter().map(sum).collect();
        let (_, teams) = teams_of(&system, &colors);
        let others: usize = teams.others.iter().map(Vec::len).sum();
        assert!(others * 10 < count, "{others} of {count} vertices are in no team");
    }

    #[test]
    fn a_body_without_constraints_has_teams_too() {
        let groups = Groups { order: vec![0, 1, 2, 3], offsets: vec![0, 4] };
        let teams = Teams::<f64>::find(4, &groups, &[], &[]);
        assert_eq!(members(&teams, 0), [[0, 1, 2, 3]]);
        let none = Groups { order: vec![], offsets: vec![0] };
        assert_eq!(Teams::<f64>::find(0, &none, &[], &[]).others(0), None);
    }

    #[test]
    fn changed_vertices_leave_their_team() {
        let (groups, mut teams) = chain();
        teams.dissolve([35].into_iter());
        teams.regroup(&groups);
        assert_eq!(members(&teams, 0), [even(2..=32)]);
        assert_eq!(members(&teams, 1), [even(1..=31)]);
        assert_eq!(teams.others(1).unwrap(), [33, 35, 37, 39]);
    }

    #[test]
    fn a_team_whose_vertices_change_their_color_is_dissolved() {
        let (_, mut teams) = chain();
        // Vertex 4 gets another color, and vertex 35 does not move.
        let colors: Vec<u16> = (0..41).map(|v| if v == 4 { 2 } else { v % 2 }).collect();
        let moves: Vec<bool> = (0..41).map(|v| v != 35).collect();
        teams.regroup(&Groups::from_colors(&colors).unwrap().restricted_to(&moves));
        assert_eq!(members(&teams, 0), Vec::<Vec<u32>>::new());
        assert_eq!(members(&teams, 1), [even(1..=31)]);
        assert_eq!(teams.others(0).unwrap(), [&[0, 2][..], &even(6..=40)].concat());
        assert_eq!(teams.others(1).unwrap(), [33, 37, 39]);
        assert_eq!(teams.others(2).unwrap(), [4]);
    }
}
