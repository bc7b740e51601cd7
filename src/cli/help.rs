//! `spectile help`: a command, or what a scene file may contain.

use clap::Parser;

use super::{Cli, Output};
use crate::scene::keys;
use crate::{Error, Result};

/// Explain a command, or what a scene file may contain
///
/// `spectile help COMMAND` prints what `spectile COMMAND --help` does. `spectile help scene` prints the reference of scene
/// files, the page docs/scene.md; with a section, a key or a chapter of it, that part.
#[derive(Debug, clap::Args)]
#[command(after_long_help = "\
Examples:
  spectile help render
  spectile help scene
  spectile help scene camera.perspective.fov            a key, as it stands in a file
  spectile help scene materials.plastic                 a section
  spectile help scene textures                          a chapter")]
pub struct Args {
    /// A command; or `scene`, and what of scene files to explain
    #[arg(value_name = "COMMAND | scene [KEY]")]
    pub topic: Vec<String>,
}

pub fn run(args: &Args, output: &Output) -> Result<()> {
    let topic: Vec<&str> = args.topic.iter().map(String::as_str).collect();
    match topic[..] {
        ["scene"] => output.text(&keys::text(None).map_err(Error::Usage)?),
        ["scene", key] => output.text(&keys::text(Some(key)).map_err(Error::Usage)?),
        ["scene", ..] => Err(Error::Usage("help scene takes one key, such as film.width".into())),
        ref command => of_command(command),
    }
}

/// What the command itself says of it.
fn of_command(command: &[&str]) -> Result<()> {
    let arguments = ["spectile"].iter().chain(command).chain(&["--help"]);
    match Cli::try_parse_from(arguments) {
        Err(answer) if !answer.use_stderr() => {
            // If nobody reads it, nobody misses it.
            let _ = answer.print();
            Ok(())
        }
        Err(mistake) => {
            let message = mistake.render().to_string();
            Err(Error::Usage(message.trim_start_matches("error: ").trim_end().to_owned()))
        }
        Ok(_) => Err(Error::Internal("--help is an answer".into())),
    }
}
