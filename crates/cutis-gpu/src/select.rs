//! Selection of an adapter by order, index or name.

use std::{convert::Infallible, fmt, str::FromStr};

use crate::{Adapter, GpuError};

/// The adapter to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Select {
    /// The first of [`adapters`](fn@crate::adapters): the best hardware, or a software adapter if
    /// there is no hardware.
    #[default]
    First,
    /// The adapter with this [`Adapter::index`], else the first whose name contains this number.
    Index(usize),
    /// The first adapter whose name contains this text, in upper or lower case.
    Name(String),
}

impl Select {
    /// Returns the selected adapter of a list from [`adapters`](fn@crate::adapters).
    ///
    /// # Errors
    ///
    /// Returns [`GpuError::NoAdapter`] for an empty list, and [`GpuError::NoSuchAdapter`] if no
    /// adapter matches.
    pub fn among<'a>(&self, adapters: &'a [Adapter]) -> Result<&'a Adapter, GpuError> {
        if adapters.is_empty() {
            return Err(GpuError::NoAdapter);
        }
        let named = |part: &str| {
            let part = part.to_lowercase();
            adapters.iter().find(|adapter| adapter.name.to_lowercase().contains(&part))
        };
        let found = match self {
            Select::First => adapters.first(),
            Select::Index(index) => adapters.get(*index).or_else(|| named(&index.to_string())),
            Select::Name(part) => named(part),
        };
        found.ok_or_else(|| GpuError::NoSuchAdapter {
            asked: self.to_string(),
            found: adapters.iter().map(|adapter| format!("{}: {}", adapter.index, adapter.name)).collect(),
        })
    }
}

impl FromStr for Select {
    type Err = Infallible;

    /// Parses a selection: `first`, the index of an adapter, or a part of its name.
    fn from_str(text: &str) -> Result<Select, Infallible> {
        let text = text.trim();
        Ok(match text.parse() {
            Ok(index) => Select::Index(index),
            Err(_) if text.eq_ignore_ascii_case("first") => Select::First,
            Err(_) => Select::Name(text.to_owned()),
        })
    }
}

impl fmt::Display for Select {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Select::First => f.write_str("first"),
            Select::Index(index) => write!(f, "{index}"),
            Select::Name(part) => f.write_str(part),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{AdapterKind, Limits};

    fn adapter(index: usize, name: &str) -> Adapter {
        Adapter {
            index,
            name: name.to_owned(),
            kind: AdapterKind::Discrete,
            api: "vulkan",
            driver: String::new(),
            limits: Limits::of(&wgpu::Limits::default()),
            timestamps: false,
            lacking: None,
        }
    }

    #[test]
    fn an_adapter_is_selected_by_order_index_and_part_of_the_name() {
        let all = [adapter(0, "Fast Card 9000"), adapter(1, "llvmpipe (LLVM)")];
        let selected = |text: &str| text.parse::<Select>().unwrap().among(&all).map(|adapter| adapter.index);
        assert_eq!(selected("first"), Ok(0));
        assert_eq!(selected("1"), Ok(1));
        assert_eq!(selected("LLVMPIPE"), Ok(1));
        assert_eq!(selected("a"), Ok(0), "the first of several matches");
        assert_eq!(selected("9000"), Ok(0), "not an index, but a part of a name");
        for missing in ["2", "other card"] {
            let error = selected(missing).unwrap_err().to_string();
            assert_eq!(
                error,
                format!("no GPU adapter '{missing}'; expected one of: 0: Fast Card 9000, 1: llvmpipe (LLVM)")
            );
        }
        assert_eq!(Select::Index(0).among(&[]), Err(GpuError::NoAdapter));
        assert!(GpuError::NoAdapter.to_string().contains("mesa-vulkan-drivers"));
    }

    #[test]
    fn a_displayed_selection_parses_to_itself() {
        for select in [Select::First, Select::Index(3), Select::Name("radeon".to_owned())] {
            assert_eq!(select.to_string().parse(), Ok(select));
        }
    }
}
