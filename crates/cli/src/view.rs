use crate::args::ViewArgs;
use crate::json;
use crate::part::region_of;
use crate::progress::{Progress, at_terminal};
use crate::quiet::summary_out;
use crate::stop_signal;
use indicatif::{HumanBytes, HumanCount};
use parking_lot::Mutex;
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use voxtile_compare::CompareOptions;
use voxtile_view::{CompareWith, PageOptions, View, ViewOptions, export_page};

pub fn run(args: &ViewArgs) -> anyhow::Result<ExitCode> {
    if let Some(folder) = &args.export_page {
        return export(args, folder);
    }
    let mut options = CompareOptions::default().with_tolerance(args.tolerance);
    options = args.min_voxels.map_or(options.clone(), |voxels| options.with_min_voxels(voxels));
    options = args.certainty.map_or(options.clone(), |certainty| options.with_certainty(certainty));
    let compare = args.compare.clone().map(|map| CompareWith {
        map,
        options,
        progress: bar(|_| Progress::over_blocks()),
    });
    let view = View::open(&ViewOptions {
        maps: args.maps.clone(),
        compare,
        listen: args.listen,
        token: args.token.clone(),
        keeps_levels: !args.no_cache,
        progress: bar(Progress::over_tiles),
    })?;
    report(args, &view)?;
    if !args.no_browser && !args.json && std::io::stdout().is_terminal() && has_screen() {
        // The URL is printed, so continue if no browser starts.
        if let Err(error) = open::that_detached(view.url()) {
            log::info!("cannot start a browser: {error}");
        }
    }
    view.serve()?;
    Ok(ExitCode::SUCCESS)
}

/// Writes the page for static web servers.
fn export(args: &ViewArgs, folder: &Path) -> anyhow::Result<ExitCode> {
    let watch = at_terminal(stop_signal::catch_unfinished()?);
    let options = PageOptions {
        maps: args.maps.clone(),
        output: folder.to_owned(),
        finest: args.finest,
        region: args.region.as_deref().map(region_of).transpose()?,
    };
    let summary = export_page(&options, &watch)?;
    for reason in &summary.unreadable {
        log::warn!("left out: {reason}");
    }
    let mut out = summary_out(args.json);
    if args.json {
        json::print(&serde_json::to_value(summary)?, &mut out)?;
        return Ok(ExitCode::SUCCESS);
    }
    writeln!(out, "page      {}", summary.output.display())?;
    writeln!(
        out,
        "content   {} tiles, {} nodes in {} files, {}",
        HumanCount(summary.tiles),
        HumanCount(summary.nodes),
        HumanCount(summary.files),
        HumanBytes(summary.bytes)
    )?;
    writeln!(out, "to serve  python3 -m http.server -d {}", quoted(&summary.output))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns a path as a word for a shell.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = text.chars().all(|letter| letter.is_alphanumeric() || "/._-+".contains(letter));
    if is_plain { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
}

/// Returns a progress callback that shows a bar, made for a number of parts.
fn bar(make: impl Fn(usize) -> Progress + Send + Sync + 'static) -> voxtile_view::Progress {
    let shown: Mutex<Option<Progress>> = Mutex::new(None);
    Arc::new(move |done, all| {
        let mut shown = shown.lock();
        if done >= all {
            *shown = None;
            return;
        }
        let parts = usize::try_from(all).unwrap_or(usize::MAX);
        shown.get_or_insert_with(|| make(parts)).set(done, all);
    })
}

fn report(args: &ViewArgs, view: &View) -> anyhow::Result<()> {
    let (mut out, url, address) = (std::io::stdout().lock(), view.url(), view.address());
    if args.json {
        json::print(&serde_json::json!({ "url": url, "listen": address.to_string() }), &mut out)?;
        return Ok(out.flush()?);
    }
    writeln!(out, "open {url}")?;
    if address.ip().is_loopback() && std::env::var_os("SSH_CONNECTION").is_some() {
        let port = address.port();
        writeln!(out, "from another machine: ssh -L {port}:127.0.0.1:{port} THIS_MACHINE")?;
    }
    writeln!(out, "press Ctrl-C to stop")?;
    Ok(out.flush()?)
}

/// Returns whether there is a screen for a browser.
fn has_screen() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !cfg!(target_os = "linux") || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}
