//! The choice of one adapter: the first, by index or by name.

use std::{convert::Infallible, fmt, str::FromStr};

use crate::{Adapter, GpuError};

/// Which adapter to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Select {
    /// The first of [`adapters`](fn@crate::adapters): the best hardware, a software adapter if there is nothing else.
    #[default]
    First,
    /// The adapter with this [`Adapter::index`]; if there is none, the first whose name has this number in it.
    Index(usize),
    /// The first adapter whose name has this part, upper or lower case alike.
    Name(String),
}

impl Select {
    /// The one of `adapters`, as [`adapters`](fn@crate::adapters) lists them, that is meant.
    ///
    /// # Errors
    ///
    /// [`GpuError::NoAdapter`] if there is none at all, [`GpuError::NoSuchAdapter`] if none of them is meant.
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

    /// A number is an index (or, where there are not so many, a part of a name), `first` is the first, anything else a part of
    /// a name.
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
    fn an_adapter_is_chosen_by_order_index_and_part_of_the_name() {
        let all = [adapter(0, "Fast Card 9000"), adapter(1, "llvmpipe (LLVM)")];
        let chosen = |text: &str| text.parse::<Select>().unwrap().among(&all).map(|adapter| adapter.index);
        assert_eq!(chosen("first"), Ok(0));
        assert_eq!(chosen("1"), Ok(1));
        assert_eq!(chosen("LLVMPIPE"), Ok(1));
        assert_eq!(chosen("a"), Ok(0), "the first of several");
        assert_eq!(chosen("9000"), Ok(0), "no index, but a part of a name");
        for missing in ["2", "other card"] {
            let error = chosen(missing).unwrap_err().to_string();
            assert_eq!(
                error,
                format!("no GPU adapter '{missing}'; there is: 0: Fast Card 9000, 1: llvmpipe (LLVM)")
            );
        }
        assert_eq!(Select::Index(0).among(&[]), Err(GpuError::NoAdapter));
        assert!(GpuError::NoAdapter.to_string().contains("mesa-vulkan-drivers"));
    }

    #[test]
    fn a_choice_is_written_as_it_is_read() {
        for select in [Select::First, Select::Index(3), Select::Name("radeon".to_owned())] {
            assert_eq!(select.to_string().parse(), Ok(select));
        }
    }
}
