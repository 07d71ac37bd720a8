//! Underminings and excisions: what they separate and what they take out.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use cutis_mesh::{
    Cut, Excision, Incision, Lattice, MeshError, Piece, Pocket, Slit, Split, TetMesh, Undermining,
};
use nalgebra::Point3;

use crate::incision::{body, reached};

pub const SPLITS: [Split; 2] = [Split::Kuhn6, Split::Five];

/// A block of 80 × 60 × 24 mm whose upper face is at z = 24 mm, in steps of 2 mm.
pub fn block(split: Split) -> (TetMesh, Vec<[u32; 3]>) {
    let affine = cutis_volume::Affine::from_spacing([2.0; 3], [-4.0; 3]).unwrap();
    let grid = cutis_volume::Grid { shape: [45, 35, 17], affine };
    let within = |v: f64, high: f64| (-1e-9..=high + 1e-9).contains(&v);
    body(&Lattice::new(grid, split).unwrap(), |p| {
        within(p[0], 80.0) && within(p[1], 60.0) && within(p[2], 24.0)
    })
}

/// Plans incisions, underminings and excisions.
pub fn plan(
    mesh: &TetMesh,
    triangles: &[[u32; 3]],
    incisions: &[Incision],
    underminings: &[Undermining],
    excisions: &[Excision],
) -> Result<Cut, MeshError> {
    let skin: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| mesh.lattice_index[v as usize])).collect();
    let slits = Slit::on_lattice(&mesh.lattice, &skin, incisions)?;
    let pieces = Piece::on_lattice(&mesh.lattice, &skin, excisions)?;
    let pockets = Pocket::on_lattice(&mesh.lattice, &skin, &slits, &pieces, underminings)?;
    Cut::of_slits(mesh, triangles, slits)?.with(mesh, pockets, pieces)
}

pub fn along_x(y: f64, depth_mm: f64) -> Incision {
    Incision { path_mm: vec![[20.0, y, 24.0], [60.0, y, 24.0]], depth_mm, width_mm: None }
}

/// An ellipse of 40 × 16 mm in the middle of the block's upper face.
pub fn ellipse(depth_mm: f64) -> Excision {
    let point = |n: usize| {
        let angle = TAU * n as f64 / 24.0;
        [40.0 + 20.0 * angle.cos(), 30.0 + 8.0 * angle.sin(), 24.0]
    };
    Excision { path_mm: (0..24).chain([0]).map(point).collect(), depth_mm }
}

fn volume_mm3(mesh: &TetMesh) -> f64 {
    mesh.tet_volumes().iter().map(|&volume| f64::from(volume) * 1e9).sum()
}

fn volume_of(tets: &[[u32; 4]], at: &dyn Fn(u32) -> Point3<f64>) -> f64 {
    let of = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(at);
        ((b - a).cross(&(c - a)).dot(&(d - a)) / 6.0).abs() * 1e9
    };
    tets.iter().map(of).sum()
}

/// The piece has the area of its outline times its depth. Control: another depth.
#[test]
fn an_excision_takes_out_its_piece_and_nothing_else() {
    for split in SPLITS {
        for depth in [6.0, 8.0] {
            let (mut mesh, mut skin) = block(split);
            let before = volume_mm3(&mesh);
            let area: f64 = skin_area(&mesh, &skin);
            let mut cut = plan(&mesh, &skin, &[], &[], &[ellipse(depth)]).unwrap();
            let severed = cut.sever(&mut mesh, &mut skin).unwrap().unwrap();
            let gone = before - volume_mm3(&mesh);
            // The polygon with 24 corners inside the ellipse.
            let outline = 0.5 * 24.0 * 20.0 * 8.0 * (TAU / 24.0).sin();
            assert!(
                (gone / (outline * depth) - 1.0).abs() < 0.03,
                "{split:?}: {gone} of {}",
                outline * depth
            );
            assert!((gone / (outline * (14.0 - depth)) - 1.0).abs() > 0.2);
            let at = |corner: u32| match (corner as usize).checked_sub(mesh.positions.len()) {
                None => mesh.positions[corner as usize].cast::<f64>(),
                Some(point) => severed.tet_pieces.points[point].at(&mesh.positions).cast(),
            };
            // Thin parts get a least share, so volumes agree only nearly.
            let taken_out = severed.taken_out.concat();
            assert!((volume_of(&taken_out, &at) / gone - 1.0).abs() < 0.01);
            let (whole, pieces) = (&mesh.tets[..mesh.whole_tets()], &severed.tet_pieces.simplices);
            let kept = volume_of(whole, &at) + volume_of(pieces, &at);
            assert!((kept + volume_of(&taken_out, &at) - before).abs() < 1e-3 * before);
            let lost = area - skin_area_cut(&mesh, &skin, &severed);
            assert!((lost / outline - 1.0).abs() < 0.02, "{lost} of {outline} mm²");
            // What is left is one body, and it still has all vertices outside the piece.
            let inside = |v: usize| {
                let p = mesh.frame.to_mm(mesh.positions[v]);
                ((p.x - 40.0) / 20.0).powi(2) + ((p.y - 30.0) / 8.0).powi(2) < 0.95 && p.z > 24.5 - depth
            };
            for v in 0..mesh.real_vertices() {
                assert!(!inside(v) || cut.removed[v], "vertex {v}");
            }
            let held: BTreeSet<u32> = mesh.tets.iter().flatten().copied().collect();
            assert_eq!(reached(&mesh, mesh.tets[0][0], |_| true), held);
            let gape = cut.gapes[0].measure(&mesh.positions);
            assert!((gape.mid_mm / 16.0 - 1.0).abs() < 0.02, "{gape:?}");
        }
    }
}

/// A lens of 40 × 6 mm with pointed ends in the middle of the block's upper face, `turned` from its
/// long side.
fn lens(depth_mm: f64, turned: f64) -> Excision {
    let arc = |n: usize, side: f64| {
        let part = n as f64 / 12.0;
        let (along, across) = (40.0 * part - 20.0, side * 12.0 * part * (1.0 - part));
        let (sin, cos) = turned.sin_cos();
        [40.3 + along * cos - across * sin, 29.0 + along * sin + across * cos, 24.0]
    };
    let there = (0..12).map(|n| arc(n, -1.0));
    let back = (1..=12).rev().map(|n| arc(n, 1.0));
    Excision { path_mm: there.chain(back).chain([arc(0, 0.0)]).collect(), depth_mm }
}

/// A piece with pointed ends is taken out up to its ends, though it is thinner than a lattice step
/// there. The parts of tets with a corner in the piece are only 0.54 of its ends if it lies between
/// the points of the lattice.
#[test]
fn a_piece_is_taken_out_up_to_its_pointed_ends() {
    for split in SPLITS {
        for turned in [0.0, 0.2, 0.9] {
            let (mut mesh, mut skin) = block(split);
            let depth = 8.0;
            let mut cut = plan(&mesh, &skin, &[], &[], &[lens(depth, turned)]).unwrap();
            let severed = cut.sever(&mut mesh, &mut skin).unwrap().unwrap();
            let at = |corner: u32| match (corner as usize).checked_sub(mesh.positions.len()) {
                None => mesh.positions[corner as usize].cast::<f64>(),
                Some(point) => severed.tet_pieces.points[point].at(&mesh.positions).cast(),
            };
            // Length along the axis from the middle, for points in local meters.
            let along = |p: Point3<f64>| {
                let p = mesh.frame.to_mm(p.cast());
                (p.x - 40.3) * turned.cos() + (p.y - 29.0) * turned.sin()
            };
            // Above the floor and up to a lattice step from their ends the walls do not touch: the
            // tissue between them is gone.
            let touches = |pair: &&cutis_mesh::sever::LipPair| {
                let [a, b] = pair.edge.map(|v| mesh.positions[v as usize].cast::<f64>());
                let at = a + (b - a) * f64::from(pair.part);
                along(at).abs() < 18.0 && mesh.frame.to_mm(at.cast()).z > 24.5 - depth
            };
            assert_eq!(severed.lip_pairs.iter().filter(touches).count(), 0, "{split:?} {turned}");
            let taken = severed.taken_out.concat();
            let at_ends = |tet: &&[u32; 4]| {
                tet.iter().map(|&corner| along(at(corner)).abs()).sum::<f64>() / 4.0 >= 15.0
            };
            let ends: Vec<[u32; 4]> = taken.iter().filter(at_ends).copied().collect();
            // The polygon between both chains of chords.
            let width = |part: f64| {
                let (n, share) = ((12.0 * part).floor(), (12.0 * part).fract());
                let at = |n: f64| 24.0 * n / 12.0 * (1.0 - n / 12.0);
                at(n) + share * (at(n + 1.0) - at(n))
            };
            let area = |from: f64, to: f64| {
                let middles = (0..1000).map(|n| from + (to - from) * (n as f64 + 0.5) / 1000.0);
                middles.map(|s| width(s / 40.0)).sum::<f64>() * (to - from) / 1000.0
            };
            let all = volume_of(&taken, &at) / (area(0.0, 40.0) * depth);
            assert!((all - 1.0).abs() < 0.06, "{split:?} {turned}: {all}");
            let of_ends = volume_of(&ends, &at) / (2.0 * area(0.0, 5.0) * depth);
            assert!((0.8..1.05).contains(&of_ends), "{split:?} {turned}: {of_ends}");
        }
    }
}

fn skin_area(mesh: &TetMesh, triangles: &[[u32; 3]]) -> f64 {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize].cast::<f64>());
        (b - a).cross(&(c - a)).norm() / 2.0 * 1e6
    };
    triangles.iter().map(area).sum()
}

fn skin_area_cut(mesh: &TetMesh, triangles: &[[u32; 3]], severed: &cutis_mesh::sever::Severed) -> f64 {
    let (whole, copies) = triangles.split_at(triangles.len() - severed.copies.len());
    let share = |(triangle, copy): (&[u32; 3], &cutis_mesh::sever::TriangleCopy)| {
        skin_area(mesh, &[*triangle]) * f64::from(copy.share)
    };
    skin_area(mesh, whole) + copies.iter().zip(&severed.copies).map(share).sum::<f64>()
}

/// Before its time an excision changes nothing, and at its time it leaves what a static one leaves.
#[test]
fn an_excision_happens_at_once_at_its_time() {
    for split in SPLITS {
        let (whole, whole_skin) = block(split);
        let all = volume_mm3(&whole);
        let make = || {
            let (mesh, skin) = block(split);
            let cut = plan(&mesh, &skin, &[along_x(30.0, 10.0)], &[UNDERMINING], &[ellipse(8.0)]).unwrap();
            (mesh, skin, cut)
        };
        let (mut mesh, mut skin, mut cut) = make();
        let (_, growth) = cut.sever_growing(&mut mesh, &mut skin).unwrap().unwrap();
        let lengths = growth.lengths();
        let volume = |reached: &[f64]| {
            let stage = growth.stage(reached);
            let outside = volume_of(&mesh.tets[..mesh.whole_tets()], &|v| mesh.positions[v as usize].cast());
            outside + stage.tets.iter().map(|copy| mesh.copy_volume(copy) * 1e9).sum::<f64>()
        };
        let (mut static_mesh, mut static_skin, mut static_cut) = make();
        static_cut.sever(&mut static_mesh, &mut static_skin).unwrap();
        let left = volume_mm3(&static_mesh);
        // Two blades cut the piece out.
        assert!((volume(&[0.0; 4]) / all - 1.0).abs() < 1e-5);
        assert!((volume(&[lengths[0], lengths[1], 0.0, 0.0]) / all - 1.0).abs() < 1e-5);
        assert!((volume(&[0.0, 0.0, lengths[2], lengths[3]]) / left - 1.0).abs() < 1e-5);
        assert!((volume(&lengths) / left - 1.0).abs() < 1e-5);
        assert!(left < 0.97 * all);
        let end = growth.stage(&lengths);
        let copies: Vec<[u32; 4]> = end.tets.iter().map(|copy| copy.nodes).collect();
        assert_eq!(copies, static_mesh.tets[static_mesh.whole_tets()..]);
        assert_eq!(
            growth.stage(&[0.0; 4]).triangles.len(),
            whole_skin.len() - untouched(&static_skin, &growth)
        );
        assert_eq!(skin, static_skin);
    }
}

fn untouched(skin: &[[u32; 3]], growth: &cutis_mesh::sever::Growth) -> usize {
    let end = growth.stage(&growth.lengths());
    skin.len() - end.triangles.len()
}

const UNDERMINING: Undermining = Undermining { wound: 0, distance_mm: 12.0, depth_mm: 6.0 };

/// Vertices below the floor of the pocket that can be reached from the skin within a box on one
/// side of the incision, without going around the pocket.
fn reached_below(mesh: &TetMesh, far: f64) -> usize {
    let start = (0..mesh.real_vertices() as u32).find(|&v| {
        let p = mesh.frame.to_mm(mesh.positions[v as usize]);
        (p - Point3::new(40.0, 34.0, 24.0)).norm() < 1e-3
    });
    let inside =
        |p: Point3<f64>| (26.0..=54.0).contains(&p.x) && (31.0..=30.0 + far).contains(&p.y) && p.z > 12.0;
    let found = reached(mesh, start.unwrap(), inside);
    found.iter().filter(|&&v| mesh.frame.to_mm(mesh.positions[v as usize]).z < 17.0).count()
}

/// Skin within the distance is separated from what is below it. Controls: without the undermining,
/// and beyond its end.
#[test]
fn an_undermining_separates_the_skin_from_what_is_below() {
    for split in SPLITS {
        let cut_with = |underminings: &[Undermining]| {
            let (mut mesh, mut skin) = block(split);
            let all = volume_mm3(&mesh);
            let mut cut = plan(&mesh, &skin, &[along_x(30.0, 10.0)], underminings, &[]).unwrap();
            cut.sever(&mut mesh, &mut skin).unwrap();
            assert!((volume_mm3(&mesh) / all - 1.0).abs() < 1e-5, "nothing is removed");
            mesh
        };
        let mesh = cut_with(&[UNDERMINING]);
        assert_eq!(reached_below(&mesh, 9.0), 0, "{split:?}");
        assert!(reached_below(&mesh, 16.0) > 0);
        assert!(reached_below(&cut_with(&[]), 9.0) > 0);
    }
}

/// An undermining grows from the incision outwards.
#[test]
fn an_undermining_grows_from_its_incision() {
    let (mut mesh, mut skin) = block(Split::Five);
    let mut cut = plan(&mesh, &skin, &[along_x(30.0, 10.0)], &[UNDERMINING], &[]).unwrap();
    let (_, growth) = cut.sever_growing(&mut mesh, &mut skin).unwrap().unwrap();
    let lengths = growth.lengths();
    assert!((lengths[1] - 0.012).abs() < 1e-9);
    let below = |reached: f64, far: f64| {
        let stage = growth.stage(&[lengths[0], reached]);
        let mut at_stage = mesh.clone();
        at_stage.tets.truncate(mesh.whole_tets());
        at_stage.tets.extend(stage.tets.iter().map(|copy| copy.nodes));
        reached_below(&at_stage, far)
    };
    assert!(below(0.0, 5.0) > 0);
    assert_eq!(below(0.008, 5.0), 0);
    assert!(below(0.008, 11.0) > 0);
    assert_eq!(below(0.012, 9.0), 0);
}

/// Under curved skin the floor of a pocket has an even depth.
#[test]
fn the_floor_of_a_pocket_follows_curved_skin() {
    let affine = cutis_volume::Affine::from_spacing([2.0; 3], [0.0, -40.0, -40.0]).unwrap();
    let grid = cutis_volume::Grid { shape: [31, 41, 41], affine };
    let lattice = Lattice::new(grid, Split::Five).unwrap();
    let (mut mesh, mut skin) = body(&lattice, |p| p[1].hypot(p[2]) <= 32.0);
    let path_mm = vec![[20.0, 0.0, 32.0], [40.0, 0.0, 32.0]];
    let incision = Incision { path_mm, depth_mm: 8.0, width_mm: None };
    let undermining = Undermining { wound: 0, distance_mm: 16.0, depth_mm: 6.0 };
    let mut cut = plan(&mesh, &skin, &[incision], &[undermining], &[]).unwrap();
    let severed = cut.sever(&mut mesh, &mut skin).unwrap().unwrap();
    let walls = severed.tet_pieces.points.iter().map(|point| {
        let p = mesh.frame.to_mm(point.at(&mesh.positions));
        (p, 32.0 - p.y.hypot(p.z))
    });
    // Away from the incision all walls belong to the pocket.
    let floor: Vec<f64> =
        walls.filter(|(p, _)| p.y.abs() > 2.0 && p.x > 20.0 && p.x < 40.0).map(|(_, depth)| depth).collect();
    assert!(floor.len() > 200, "{}", floor.len());
    let mean = floor.iter().sum::<f64>() / floor.len() as f64;
    let spread = floor.iter().map(|depth| (depth - mean).abs()).fold(0.0, f64::max);
    // The skin of the lattice lies below the true one by up to a step. Its floor is even.
    assert!((6.0..8.0).contains(&mean) && spread < 0.5, "{mean} ± {spread} mm");
}

#[test]
fn cuts_that_cannot_be_made_are_refused_by_name() {
    let (mesh, skin) = block(Split::Five);
    let undermined = |undermining: Undermining| {
        plan(&mesh, &skin, &[along_x(30.0, 10.0)], &[undermining], &[]).unwrap_err().to_string()
    };
    let text = undermined(Undermining { wound: 1, ..UNDERMINING });
    assert!(text.contains("undermining 0") && text.contains("no wound 1"), "{text}");
    let text = undermined(Undermining { depth_mm: 12.0, ..UNDERMINING });
    assert!(text.contains("12 mm deep") && text.contains("10.0 mm deep"), "{text}");
    let text = undermined(Undermining { distance_mm: f64::NAN, ..UNDERMINING });
    assert!(text.contains("`distance_mm` is NaN"), "{text}");
    let excised = |change: &dyn Fn(&mut Excision)| {
        let mut excision = ellipse(8.0);
        change(&mut excision);
        plan(&mesh, &skin, &[], &[], &[excision]).unwrap_err().to_string()
    };
    let text = excised(&|excision| {
        excision.path_mm.pop();
    });
    assert!(text.contains("excision 0") && text.contains("not closed"), "{text}");
    let text = excised(&|excision| excision.path_mm.swap(3, 15));
    assert!(text.contains("excision 0") && !text.contains("incision"), "{text}");
    let text = excised(&|excision| {
        excision.path_mm =
            vec![[30.0, 25.0, 24.0], [50.0, 25.0, 24.0], [50.0, 26.0, 24.0], [30.0, 25.0, 24.0]]
    });
    assert!(text.contains("turns by") && text.contains("round it off"), "{text}");
    let text = excised(&|excision| excision.path_mm.iter_mut().for_each(|point| point[2] += 100.0));
    assert!(text.contains("from the skin"), "{text}");
    let text = excised(&|excision| excision.depth_mm = -1.0);
    assert!(text.contains("depth_mm"), "{text}");
    assert!(plan(&mesh, &skin, &[along_x(30.0, 10.0)], &[UNDERMINING], &[ellipse(8.0)]).is_ok());
}

/// A cut through the body sets a piece free, and an excision does not. Control: a cut that ends in
/// the body.
#[test]
fn a_cut_through_the_body_sets_a_piece_free() {
    let parts = |incision: Incision, excisions: &[Excision]| {
        let (mut mesh, mut skin) = block(Split::Five);
        let all = volume_mm3(&mesh);
        let mut cut = plan(&mesh, &skin, &[incision], &[], excisions).unwrap();
        cut.sever(&mut mesh, &mut skin).unwrap();
        (mesh.part_volumes().iter().map(|volume| volume * 1e9).collect::<Vec<f64>>(), all)
    };
    let through = |depth_mm| {
        let path_mm = vec![[-6.0, 20.3, 24.0], [86.0, 20.3, 24.0]];
        Incision { path_mm, depth_mm, width_mm: None }
    };
    let (volumes, all) = parts(through(30.0), &[]);
    assert_eq!(volumes.len(), 2);
    assert!((volumes[1] / all - 20.3 / 60.0).abs() < 0.01, "{volumes:?} of {all}");
    assert!((volumes[0] + volumes[1] - all).abs() < 1e-4 * all);
    assert_eq!(parts(through(10.0), &[]).0.len(), 1);
    assert_eq!(parts(along_x(50.0, 10.0), &[ellipse(8.0)]).0.len(), 1);
}
