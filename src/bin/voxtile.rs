//! The command `voxtile`.

fn main() -> std::process::ExitCode {
    voxtile::command::main()
}
