use crate::scan_input::{ScanInput, ScanInputs};
use crate::watch::Watch;
use std::vec;
use voxtile::{Error, Result};
use voxtile_formats::{PointStore, PoseSource, ReadOptions, ScanHead, ScanSource, Selection};

/// Scans of several inputs, one input after the other. An input is opened when the one before it has ended.
pub struct InputChain {
    inputs: vec::IntoIter<ScanInput>,
    options: ReadOptions,
    watch: Watch,
    current: Option<(ScanInput, Box<dyn ScanSource + Send>)>,
    remarks: Vec<String>,
    crs: Option<String>,
    format: String,
    fields: Vec<String>,
    poses: PoseSource,
}

impl InputChain {
    /// Opens the first input. The selection of the options applies to the chain, so it is left to the caller.
    pub fn open(inputs: &ScanInputs, options: &ReadOptions, watch: &Watch) -> Result<Self> {
        let mut options = ReadOptions { selection: Selection::default(), ..options.clone() };
        options.clouds.are_poses_shared = inputs.inputs().len() > 1;
        let mut chain = Self {
            inputs: inputs.inputs().to_vec().into_iter(),
            options,
            watch: watch.clone(),
            current: None,
            remarks: inputs.remarks().to_vec(),
            crs: None,
            format: String::new(),
            fields: Vec::new(),
            poses: PoseSource::Missing,
        };
        chain.open_next()?;
        if let Some((_, source)) = &chain.current {
            (chain.format, chain.poses) = (source.format(), source.pose_source());
        }
        Ok(chain)
    }

    /// Closes the current input and opens the next one. Returns `false` if there is none.
    fn open_next(&mut self) -> Result<bool> {
        if let Some((input, source)) = self.current.take() {
            self.remarks.extend(remarks_of(&input, &*source));
            self.fields = source.fields();
            self.crs = self.crs.take().or_else(|| source.crs());
        }
        let Some(input) = self.inputs.next() else { return Ok(false) };
        let source = input.open(&self.options, &self.watch)?;
        self.current = Some((input, source));
        Ok(true)
    }
}

fn remarks_of(input: &ScanInput, source: &dyn ScanSource) -> Vec<String> {
    source.remarks().iter().map(|remark| format!("{input}: {remark}")).collect()
}

impl ScanSource for InputChain {
    fn len_hint(&self) -> Option<usize> {
        // Later inputs are not open yet.
        None
    }

    fn read_scan(&mut self, points: &mut PointStore) -> Result<Option<ScanHead>> {
        loop {
            if let Some((_, source)) = &mut self.current
                && let Some(head) = source.read_scan(points)?
            {
                return Ok(Some(head));
            }
            if !self.open_next()? {
                return Ok(None);
            }
        }
    }

    fn skip(&mut self, scans: usize) -> Result<usize> {
        let mut skipped = 0;
        loop {
            if let Some((_, source)) = &mut self.current {
                skipped += source.skip(scans - skipped)?;
            }
            if skipped >= scans || !self.open_next()? {
                return Ok(skipped);
            }
        }
    }

    fn pass_unread(&mut self) -> bool {
        self.current.as_mut().is_some_and(|(_, source)| source.pass_unread())
    }

    fn format(&self) -> String {
        self.format.clone()
    }

    fn fields(&self) -> Vec<String> {
        self.current.as_ref().map_or_else(|| self.fields.clone(), |(_, source)| source.fields())
    }

    fn remarks(&self) -> Vec<String> {
        let current = self.current.iter().flat_map(|(input, source)| remarks_of(input, &**source));
        self.remarks.iter().cloned().chain(current).collect()
    }

    fn crs(&self) -> Option<String> {
        self.crs.clone().or_else(|| self.current.as_ref()?.1.crs())
    }

    fn pose_source(&self) -> PoseSource {
        self.poses.clone()
    }

    fn fingerprint(&self) -> Result<String> {
        Err(Error::argument("SCANS", "several inputs have no common fingerprint"))
    }
}
