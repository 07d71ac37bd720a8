//! Reads unusual NIfTI files and compares the results with nibabel 5.4.2.
//!
//! The expected values are those of nibabel except for `no_form`. Without a form, nibabel mirrors
//! and centers the volume, ITK reads the axes as LPS, and Cutis follows method 1 of the standard
//! (voxel sizes only). SimpleITK 2.5.7 agrees for every file that it reads, with three exceptions:
//! for `i16_slope0` it adds the intercept, for `q_s_conflict` it prefers the qform, and `no_form`.

use cutis_test_kit::scans;
use cutis_volume::{Loaded, VolumeError, nifti};

type Rows = [[f64; 4]; 3];

const SHAPE: [usize; 3] = [40, 33, 36];
const SUM: f64 = -18136332.0;
const D: [f64; 3] = [9.307692527770996, 9.375, 9.514286041259766];
const O: [f64; 3] = [-177.95632934570312, 11.319000244140625, 94.3017578125];
const BASE: Rows = [[D[0], 0.0, 0.0, O[0]], [0.0, D[1], 0.0, O[1]], [0.0, 0.0, D[2], O[2]]];
const ORDINARY: (f64, f64) = (-1000.0, 2837.0);

struct Expected {
    file: &'static str,
    dtype: &'static str,
    shape: [usize; 3],
    rows: Rows,
    range: (f64, f64),
    sum: f64,
    nan_count: u64,
    /// A phrase of each warning.
    warnings: &'static [&'static str],
}

/// A file with the same content as the plain one, but stored differently.
const fn same(file: &'static str, dtype: &'static str) -> Expected {
    Expected { file, dtype, shape: SHAPE, rows: BASE, range: ORDINARY, sum: SUM, nan_count: 0, warnings: &[] }
}

const ACCEPTED: &[Expected] = &[
    same("4d_x1.nii.gz", "int16"),
    Expected {
        shape: [40, 33, 9],
        rows: [BASE[0], BASE[1], [0.0, 0.0, 38.05714416503906, O[2]]],
        sum: -4515094.0,
        ..same("aniso_z.nii.gz", "int16")
    },
    same("base_i16.nii.gz", "int16"),
    same("bigendian_f32.nii.gz", "float32"),
    same("bigendian_i16.nii", "int16"),
    same("bigendian_i16.nii.gz", "int16"),
    Expected { range: (-1000.0, -1000.0), sum: -47520000.0, ..same("const_air.nii.gz", "int16") },
    same("f32.nii.gz", "float32"),
    Expected {
        sum: -6948429.0,
        nan_count: 12528,
        warnings: &["NaN"],
        ..same("f32_nan_padding.nii.gz", "float32")
    },
    same("f64.nii.gz", "float64"),
    same("gzip_multimember.nii.gz", "int16"),
    same("i16_slope0.5_inter-1024.nii.gz", "int16"),
    Expected { warnings: &["scl_slope"], ..same("i16_slope0.nii.gz", "int16") },
    same("i16_slope_nan.nii.gz", "int16"),
    same("i32.nii.gz", "int32"),
    same("nifti2_bigendian_i16.nii.gz", "int16"),
    same("nifti2_i16.nii.gz", "int16"),
    Expected {
        rows: [[D[0], 0.0, 0.0, 0.0], [0.0, D[1], 0.0, 0.0], [0.0, 0.0, D[2], 0.0]],
        warnings: &["neither sform nor qform"],
        ..same("no_form.nii.gz", "int16")
    },
    Expected {
        rows: [
            [9.166287422180176, -1.57248055934906, 0.42760488390922546, -172.91307067871094],
            [1.6162638664245605, 8.917980194091797, -2.425067901611328, -44.17087173461914],
            [0.0, 2.4264285564422607, 9.190094947814941, 94.01807403564453],
        ],
        ..same("oblique.nii.gz", "int16")
    },
    Expected {
        rows: [[-D[0], 0.0, 0.0, 185.04368591308594], [0.0, -D[1], 0.0, 311.3190002441406], BASE[2]],
        ..same("orient_LPS.nii.gz", "int16")
    },
    Expected {
        shape: [33, 36, 40],
        rows: [
            [0.0, 0.0, D[0], O[0]],
            [-D[1], 0.0, 0.0, 311.3190002441406],
            [0.0, -D[2], 0.0, 427.3017578125],
        ],
        ..same("orient_PIR.nii.gz", "int16")
    },
    Expected {
        rows: [BASE[0], BASE[1], [0.0, 0.0, -D[2], 427.3017578125]],
        ..same("orient_RAI.nii.gz", "int16")
    },
    Expected {
        shape: [36, 33, 40],
        rows: [[0.0, 0.0, -D[0], 185.04368591308594], [0.0, D[1], 0.0, O[1]], [D[2], 0.0, 0.0, O[2]]],
        ..same("orient_SAL.nii.gz", "int16")
    },
    Expected { range: (-2000.0, 2837.0), sum: -32004429.0, ..same("pad-2000.nii.gz", "int16") },
    Expected { range: (-3024.0, 2837.0), sum: -44833101.0, ..same("pad-3024.nii.gz", "int16") },
    same("pair_i16.hdr", "int16"),
    same("pair_i16.img", "int16"),
    same("plain_i16.nii", "int16"),
    Expected {
        rows: [[D[0], 0.0, 0.0, -127.95632934570312], BASE[1], BASE[2]],
        warnings: &["qform disagree by up to 50.000 mm"],
        ..same("q_s_conflict.nii.gz", "int16")
    },
    same("qform_only.nii.gz", "int16"),
    same("sform_only.nii.gz", "int16"),
    Expected {
        rows: [BASE[0], [0.0, D[1], 3.139714479446411, 42.43857955932617], BASE[2]],
        warnings: &["not perpendicular"],
        ..same("sheared_sform_only.nii.gz", "int16")
    },
    Expected { shape: [40, 33, 1], sum: -497809.0, ..same("single_slice.nii.gz", "int16") },
    same("u16_inter-1024.nii.gz", "uint16"),
    Expected { range: (-1008.0, 2832.0), sum: -18503712.0, ..same("u8_slope16_inter-1024.nii.gz", "uint8") },
    // The rows of nibabel are in meters for this file.
    same("units_metre.nii.gz", "int16"),
    same("with_extension.nii.gz", "int16"),
];

/// Describes the differences between a volume and its expected properties.
fn problems(found: &Loaded, expected: &Expected) -> Vec<String> {
    let grid = found.volume.grid();
    let stats = found.stats;
    let mut problems = Vec::new();
    let mut check = |equal: bool, found: String| {
        if !equal {
            problems.push(found);
        }
    };
    check(grid.shape == expected.shape, format!("shape {:?}", grid.shape));
    check(found.dtype == expected.dtype, format!("type {}", found.dtype));
    check((stats.min, stats.max) == expected.range, format!("range {stats:?}"));
    check(stats.sum == expected.sum && stats.nan_count == expected.nan_count, format!("stats {stats:?}"));
    for (row, expected) in grid.affine.rows().iter().zip(&expected.rows) {
        // The file holds f32: seven digits of the largest number in the row.
        let scale = expected.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let near = row.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 2.5e-7 * scale);
        check(near, format!("affine row {row:?}"));
    }
    // The voxels agree with the statistics, and NaN voxels are air.
    let voxels: f64 = found.volume.voxels().iter().map(|&stored| f64::from(found.volume.hu(stored))).sum();
    check(voxels == expected.sum - 1024.0 * expected.nan_count as f64, format!("voxel sum {voxels}"));
    let warned = found.warnings.len() == expected.warnings.len()
        && found.warnings.iter().zip(expected.warnings).all(|(warning, word)| warning.contains(word));
    check(warned, format!("warnings {:?}", found.warnings));
    problems
}

#[test]
fn files_are_read_as_nibabel_reads_them() {
    let Some(folder) = scans::find("awkward") else { return };
    for expected in ACCEPTED {
        let found = nifti::read(folder.join(expected.file)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(problems(&found, expected), Vec::<String>::new(), "{}", expected.file);
    }
    // Negative control: the comparison detects each kind of wrong expectation.
    let found = nifti::read(folder.join("base_i16.nii.gz")).unwrap();
    let base = || same("base_i16.nii.gz", "int16");
    let mut moved = BASE;
    moved[0][3] += 0.001;
    for wrong in [
        Expected { rows: moved, ..base() },
        Expected { sum: SUM + 1.0, ..base() },
        Expected { range: (-1000.0, 2838.0), ..base() },
        Expected { shape: [40, 36, 33], ..base() },
        Expected { warnings: &["NaN"], ..base() },
        Expected { dtype: "uint16", ..base() },
    ] {
        assert!(!problems(&found, &wrong).is_empty());
    }
}

#[test]
fn other_files_are_refused_by_name() {
    let Some(folder) = scans::find("awkward") else { return };
    let refused = ["4d_x3.nii.gz", "rgb24.nii.gz", "truncated.nii", "truncated.nii.gz"];
    for name in refused {
        let error = nifti::read(folder.join(name)).unwrap_err();
        assert!(error.to_string().contains(name), "{error}");
        match name {
            "4d_x3.nii.gz" => {
                assert!(matches!(error, VolumeError::SeveralVolumes { count: 3, .. }), "{error}")
            }
            "rgb24.nii.gz" => {
                assert!(matches!(error, VolumeError::VoxelType { dtype: "RGB24", .. }), "{error}")
            }
            "truncated.nii" => assert!(
                matches!(error, VolumeError::Truncated { expected_bytes: 95040, found_bytes: 39648, .. }),
                "{error}"
            ),
            _ => assert!(matches!(error, VolumeError::Truncated { expected_bytes: 95040, .. }), "{error}"),
        }
    }
    // Each file of the folder is in one of the two lists.
    let listed =
        |name: &str| refused.contains(&name) || ACCEPTED.iter().any(|expected| expected.file == name);
    for entry in std::fs::read_dir(&folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(listed(&name), "{name} is in no list");
    }
}
