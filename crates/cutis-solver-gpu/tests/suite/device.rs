//! A device that goes away.

use cutis_gpu::GpuOptions;
use cutis_solver::{Formulation, Solver, SolverError};
use cutis_solver_gpu::SolverGpu;

use crate::body::{Parts, body, settings};
use crate::on_each_adapter;

/// Every call says so, and the host keeps the state that it read last.
#[test]
fn a_lost_device_leaves_the_last_state_that_was_read() {
    on_each_adapter(GpuOptions::default(), |gpu| {
        let parts = Parts::all(Formulation::Xpbd);
        let mut solver = SolverGpu::new(gpu, body(parts), settings(&parts, 1)).unwrap();
        solver.step(2).unwrap();
        let (kept, time_s) = (solver.positions().unwrap(), solver.time_s());
        solver.step(1).unwrap();
        gpu.lose();
        let error = solver.step(1).unwrap_err();
        let SolverError::Device { backend: "gpu", ref reason, time_s: said } = error else {
            panic!("{error}");
        };
        assert!(reason.contains("lost"), "{reason}");
        assert_eq!(said, time_s);
        assert!(solver.positions().is_err());
        assert!(solver.positions_of(&[0]).is_err());
        assert!(solver.residuals().is_err());
        assert!(solver.simulation().system().positions() == kept);
        assert_eq!(solver.simulation().time_s(), time_s);
    });
}
