use super::cloud::{CloudHead, CloudSource, PoseAt};
use super::one::Visit;
use crate::class_selection::ClassSelection;
use crate::read_options::ReadOptions;
use voxtile::{Error, Result};

/// Wraps a source to read only the points of selected classes.
pub(crate) struct OfClasses {
    source: Box<dyn CloudSource>,
    classes: ClassSelection,
    /// Whether the caller also needs the classes of the points.
    are_wanted: bool,
    left_out: u64,
}

impl OfClasses {
    /// Wraps a source if classes are selected.
    pub(crate) fn of(source: Box<dyn CloudSource>, options: &ReadOptions) -> Box<dyn CloudSource> {
        if options.classes.is_everything() {
            return source;
        }
        let (classes, are_wanted) = (options.classes.clone(), options.attributes.classes);
        Box::new(Self { source, classes, are_wanted, left_out: 0 })
    }
}

/// Returns the error for a selection of points that have no classes.
pub(crate) fn without_classes(input: &str) -> Error {
    let reason = format!("the points of {input} have no classes: omit these options for this input");
    Error::argument("only_class, skip_class", reason)
}

/// Returns the error for a selection of returns of an input that does not number them.
pub(crate) fn without_returns(input: &str) -> Error {
    let reason = format!(
        "{input}, does not number the returns of a pulse as LAS files do: omit the option for this input"
    );
    Error::argument("returns", reason)
}

/// Returns a remark on points that were left out.
pub(crate) fn left_out_remark(left_out: u64, by: &str) -> Option<String> {
    let points = if left_out == 1 { "point was" } else { "points were" };
    (left_out > 0).then(|| format!("{left_out} {points} left out by {by}"))
}

impl CloudSource for OfClasses {
    fn format(&self) -> &str {
        self.source.format()
    }

    fn len_hint(&self) -> Option<u64> {
        self.source.len_hint()
    }

    fn ends(&self) -> Option<[String; 2]> {
        self.source.ends()
    }

    fn next_cloud(&mut self) -> Result<Option<CloudHead>> {
        let Some(mut head) = self.source.next_cloud()? else { return Ok(None) };
        if !head.attributes.classes {
            return Err(without_classes(&format!("{} ({})", head.name, self.source.format())));
        }
        head.attributes.classes = self.are_wanted;
        Ok(Some(head))
    }

    fn read_points(&mut self, visit: Visit<'_>) -> Result<()> {
        let Self { source, classes, left_out, .. } = self;
        source.read_points(&mut |point| {
            if classes.takes(point.class) {
                return visit(point);
            }
            *left_out += 1;
            Ok(())
        })
    }

    fn poses(&self) -> Option<PoseAt> {
        self.source.poses()
    }

    fn remarks(&self) -> Vec<String> {
        let left_out = left_out_remark(self.left_out, "their class");
        self.source.remarks().into_iter().chain(left_out).collect()
    }

    fn crs(&self) -> Option<&str> {
        self.source.crs()
    }
}
