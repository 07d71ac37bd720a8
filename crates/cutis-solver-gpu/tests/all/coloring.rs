//! Coloring on the GPU equals first-fit in the order of its priorities.

use cutis_coloring::{ColoringError, Groups, greedy};
use cutis_gpu::GpuOptions;
use cutis_shaders::coloring::priority;
use cutis_solver_gpu::{GpuColoringError, color};
use cutis_test_kit::Random;
use cutis_test_kit::gpu::{on_each_adapter, on_each_adapter_with};

/// Constraints with distinct vertices below `vertex_count`.
fn tuples<const N: usize>(count: usize, vertex_count: usize, seed: u64) -> Vec<[u32; N]> {
    let mut random = Random::new(seed);
    let mut one = || loop {
        let vertices: [u32; N] = std::array::from_fn(|_| random.below(vertex_count) as u32);
        if (1..N).all(|n| !vertices[..n].contains(&vertices[n])) {
            return vertices;
        }
    };
    (0..count).map(|_| one()).collect()
}

/// The colors of first-fit on the CPU, which takes the constraints from high to low priority.
fn by_priority<const N: usize>(constraints: &[[u32; N]], vertex_count: usize) -> Groups {
    let mut order: Vec<u32> = (0..constraints.len() as u32).collect();
    order.sort_by_key(|&n| std::cmp::Reverse(priority(n)));
    let sorted: Vec<[u32; N]> = order.iter().map(|&n| constraints[n as usize]).collect();
    let mut colors = vec![0; constraints.len()];
    for (color, group) in (0..).zip(greedy(&sorted, vertex_count).unwrap().iter()) {
        group.iter().for_each(|&place| colors[order[place as usize] as usize] = color);
    }
    Groups::from_colors(&colors).unwrap()
}

#[test]
fn a_gpu_colors_as_first_fit_in_the_order_of_priorities() {
    on_each_adapter(|gpu| {
        let tets = tuples::<4>(3000, 900, 1);
        let groups = color(gpu, &tets, 900).unwrap();
        groups.verify(&tets, 900).unwrap();
        assert_eq!(groups, by_priority(&tets, 900));
        assert_eq!(groups, color(gpu, &tets, 900).unwrap(), "two runs");
        // Control: the order of the list gives other groups.
        assert_ne!(groups, greedy(&tets, 900).unwrap());
        for edges in [tuples::<2>(5000, 2000, 2), vec![[1, 0]]] {
            assert_eq!(color(gpu, &edges, 2000).unwrap(), by_priority(&edges, 2000));
        }
        assert!(color::<3>(gpu, &[], 5).unwrap().is_empty());
    });
}

/// A vertex with 300 constraints needs 300 colors, more than the masks hold at a time.
#[test]
fn more_colors_than_a_mask_holds() {
    on_each_adapter(|gpu| {
        let mut edges: Vec<[u32; 2]> = (1..=300).map(|n| [0, n]).collect();
        edges.extend(tuples::<2>(400, 301, 3));
        let groups = color(gpu, &edges, 301).unwrap();
        groups.verify(&edges, 301).unwrap();
        assert!(groups.len() >= 300);
        assert_eq!(groups, by_priority(&edges, 301));
    });
}

/// Constraints and vertices that do not fit one binding are divided. The groups stay the same.
#[test]
fn parts_do_not_change_the_groups() {
    let tets = tuples::<4>(2000, 700, 4);
    let expected = by_priority(&tets, 700);
    on_each_adapter_with(&GpuOptions { chunk_cap: Some(256), ..GpuOptions::default() }, |gpu| {
        assert!(gpu.chunk_len(16) < tets.len());
        assert_eq!(color(gpu, &tets, 700).unwrap(), expected);
    });
}

#[test]
fn invalid_constraints_and_a_lost_device_are_errors() {
    on_each_adapter(|gpu| {
        let error = |edges: &[[u32; 2]]| color(gpu, edges, 3).unwrap_err();
        let range = ColoringError::VertexOutOfRange { constraint: 1, vertex: 3, vertex_count: 3 };
        assert_eq!(error(&[[0, 1], [1, 3]]), GpuColoringError::Coloring(range));
        let twice = ColoringError::RepeatedVertex { constraint: 0, vertex: 2 };
        assert_eq!(error(&[[2, 2]]), GpuColoringError::Coloring(twice));
        gpu.lose();
        assert!(matches!(error(&[[0, 1]]), GpuColoringError::Gpu(_)));
    });
}
