//! Can a map be exported in a twentieth of its memory?

use super::memory::OVERHEAD_MIB;
use crate::build::{Build, remove_folder};
use crate::case::Limit;
use crate::export::{Export, ExportFormat};
use crate::findings::Findings;
use crate::promise::{Promise, Wanted};
use crate::setting::{RAYS, Setting, mib, synthetic};
use crate::task::ChildTask;
use anyhow::Result;
use report::{Cell, Table};
use workload::SurveyName;

/// Ratio of the bytes of a map's tiles in memory to the memory of the export.
const TIMES: u64 = 20;

pub fn answer(setting: &Setting) -> Result<Findings> {
    let case = synthetic("drive", (SurveyName::Drive, RAYS, setting.size(1_500, 200)), [0.1, 10.0, 60.0]);
    let build = Build { is_kept: true, has_digest: false, ..setting.build(&case, Limit::None) };
    let built = build.clone().run_in_child()?;
    let memory_bytes = (built.tile_bytes / TIMES) as usize;
    let mut findings = Findings::default();
    findings.keep_build(&build, &built)?;
    let caption = format!(
        "Exports of a map whose tiles take {:.0} MiB in memory, {TIMES} times what the export may use; {}.",
        mib(built.tile_bytes as f64),
        case.description()
    );
    let columns = ["file", "limit MiB", "peak MiB", "before MiB", "voxels", "file MB", "seconds"];
    let mut table = Table::new("export", caption, columns);
    for format in ExportFormat::ALL {
        let folder = setting.work.join("export");
        let export = Export { map: build.folder.clone(), format, memory_bytes, folder };
        let exported = export.clone().run_in_child()?;
        findings.keep(&export, &exported)?;
        let peak_mib = mib(exported.peak_resident_bytes as f64);
        let start_mib = mib(exported.start_resident_bytes as f64);
        table.push([
            format!(".{}", format.name()).as_str().into(),
            Cell::Number(mib(memory_bytes as f64), 1),
            Cell::Number(peak_mib, 1),
            Cell::Number(start_mib, 1),
            Cell::Count(exported.voxels),
            Cell::Number(exported.file_bytes as f64 / 1e6, 1),
            Cell::Number(exported.wall_s, 1),
        ]);
        let what = format!(".{}: peak of memory beyond the limit", format.name());
        let beyond_mib = peak_mib - mib(memory_bytes as f64);
        findings.promises.push(Promise::new(what, beyond_mib, Wanted::AtMost(OVERHEAD_MIB), "MiB"));
    }
    remove_folder(&build.folder)?;
    findings.answer.tables = vec![table];
    Ok(findings)
}
