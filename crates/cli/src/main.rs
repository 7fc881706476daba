//! The command `voxtile`.

fn main() -> std::process::ExitCode {
    voxtile_cli::main()
}
