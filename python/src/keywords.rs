//! Typed access to keyword arguments.

use crate::arrays::doubles;
use crate::config::bytes_of;
use crate::errors::wrong;
use pyo3::conversion::FromPyObjectOwned;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;

/// Keyword arguments that are left to take, and the names taken so far. A value of `None` counts as not passed.
pub struct Keywords<'py> {
    left: Bound<'py, PyDict>,
    known: Vec<&'static str>,
}

impl<'py> Keywords<'py> {
    pub fn of(keywords: &Bound<'py, PyDict>) -> PyResult<Self> {
        Ok(Self { left: keywords.copy()?, known: Vec::new() })
    }

    fn value(&mut self, name: &'static str) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.known.push(name);
        let Some(value) = self.left.get_item(name)? else { return Ok(None) };
        self.left.del_item(name)?;
        if value.is_none() {
            return Ok(None);
        }
        // Converts a scalar of NumPy to a number of Python.
        let is_of_numpy = value.hasattr("dtype")? && value.getattr("ndim")?.extract::<usize>()? == 0;
        Ok(Some(if is_of_numpy { value.call_method0("item")? } else { value }))
    }

    /// Takes a value of the type that `what` describes.
    fn of_type<T: FromPyObjectOwned<'py>>(&mut self, name: &'static str, what: &str) -> PyResult<Option<T>> {
        let Some(value) = self.value(name)? else { return Ok(None) };
        let not_one = |_| wrong(value.py(), name, format!("{value:?} is not {what}"));
        value.extract::<T>().map(Some).map_err(|error| not_one(error.into()))
    }

    /// Takes a number.
    pub fn number(&mut self, name: &'static str) -> PyResult<Option<f64>> {
        self.of_type(name, "a number")
    }

    /// Takes a count.
    pub fn count(&mut self, name: &'static str) -> PyResult<Option<u64>> {
        self.of_type(name, "a whole number from 0")
    }

    /// Takes a truth value; false if it was not passed.
    pub fn flag(&mut self, name: &'static str) -> PyResult<bool> {
        Ok(self.of_type(name, "True or False")?.unwrap_or(false))
    }

    pub fn text(&mut self, name: &'static str) -> PyResult<Option<String>> {
        self.of_type(name, "a text")
    }

    pub fn path(&mut self, name: &'static str) -> PyResult<Option<PathBuf>> {
        self.of_type(name, "a path")
    }

    /// Takes a list of texts, or one text separated by commas.
    pub fn texts(&mut self, name: &'static str) -> PyResult<Option<Vec<String>>> {
        let Some(value) = self.value(name)? else { return Ok(None) };
        if let Ok(text) = value.extract::<String>() {
            return Ok(Some(text.split(',').map(str::to_owned).collect()));
        }
        let texts = value.extract::<Vec<String>>();
        texts.map(Some).map_err(|_| wrong(value.py(), name, format!("{value:?} is not a list of texts")))
    }

    /// Takes numbers of any shape, row by row.
    pub fn numbers(&mut self, name: &'static str) -> PyResult<Option<Vec<f64>>> {
        let Some(value) = self.value(name)? else { return Ok(None) };
        Ok(Some(doubles(name, &value)?.1))
    }

    /// Takes bytes: a number, or a text such as "512MiB".
    pub fn bytes(&mut self, name: &'static str) -> PyResult<Option<usize>> {
        self.value(name)?.map(|value| bytes_of(&value)).transpose()
    }

    /// Takes one of the names in `meanings` and returns its meaning.
    pub fn one_of<T: Copy>(&mut self, name: &'static str, meanings: &[(&str, T)]) -> PyResult<Option<T>> {
        let Some(value) = self.value(name)? else { return Ok(None) };
        let text = value.extract::<String>().unwrap_or_default();
        match meanings.iter().find(|(meaning, _)| *meaning == text) {
            Some(&(_, meant)) => Ok(Some(meant)),
            None => {
                let names: Vec<&str> = meanings.iter().map(|&(name, _)| name).collect();
                Err(wrong(value.py(), name, format!("{value:?} is not one of {}", names.join(", "))))
            }
        }
    }

    /// Takes a text, or the text form of another value, and parses it. The error of `parse` becomes the message.
    pub fn parsed<T, E: std::fmt::Display>(
        &mut self,
        name: &'static str,
        parse: impl FnOnce(&str) -> Result<T, E>,
    ) -> PyResult<Option<T>> {
        let Some(value) = self.value(name)? else { return Ok(None) };
        let text = value.str()?.to_string();
        parse(&text).map(Some).map_err(|error| wrong(value.py(), name, format!("{value:?}: {error}")))
    }

    /// Returns an error for the first keyword that was not taken.
    pub fn end(self) -> PyResult<()> {
        let Some(name) = self.left.keys().into_iter().next() else { return Ok(()) };
        let name = name.to_string();
        let reason = format!("unexpected argument '{name}'; there are {}", self.known.join(", "));
        Err(wrong(self.left.py(), &name, reason))
    }
}
