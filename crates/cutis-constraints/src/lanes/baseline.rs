//! Four lanes with the instructions that every processor of the architecture has.

use simba::simd::{SimdValue, WideF32x4, WideF64x4};

use super::Lanes;

macro_rules! lanes {
    ($lanes:ty, $number:ty) => {
        impl Lanes<$number> for $lanes {
            #[inline(always)]
            fn from_lanes(value: impl FnMut(usize) -> $number) -> Self {
                std::array::from_fn::<_, 4, _>(value).into()
            }

            #[inline(always)]
            fn from_quads(quad: impl Fn(usize) -> [$number; 4]) -> Self {
                quad(0).into()
            }

            #[inline(always)]
            fn quads(self, mut quad: impl FnMut(usize, [$number; 4])) {
                quad(0, self.into());
            }

            #[inline(always)]
            fn from_slice(numbers: &[$number]) -> Self {
                let mut array = [0.0; 4];
                array.copy_from_slice(&numbers[..4]);
                array.into()
            }

            #[inline(always)]
            fn write_to(self, numbers: &mut [$number]) {
                let array: [$number; 4] = self.into();
                numbers[..4].copy_from_slice(&array);
            }

            #[inline(always)]
            fn columns(row: impl Fn(usize) -> [$number; 4]) -> [Self; 4] {
                let rows: [[$number; 4]; 4] = std::array::from_fn(row);
                std::array::from_fn(|column| Self::from_lanes(|lane| rows[lane][column]))
            }

            #[inline(always)]
            fn rows(columns: [Self; 4], mut row: impl FnMut(usize, [$number; 4])) {
                for lane in 0..4 {
                    row(lane, columns.map(|column| column.extract(lane)));
                }
            }
        }
    };
}

lanes!(WideF32x4, f32);
lanes!(WideF64x4, f64);
