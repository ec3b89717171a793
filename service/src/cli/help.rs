//! Help as a terminal shows it: the texts are written for rustdoc, where a bracket needs a
//! backslash.

use clap::Command;

/// The command, its subcommands and their arguments, without rustdoc's backslashes in their help.
#[must_use]
pub fn plain(command: Command) -> Command {
    let (about, long) = (command.get_about(), command.get_long_about());
    let (about, long) = (
        about.map(ToString::to_string),
        long.map(ToString::to_string),
    );
    let mut command = command;
    if let Some(about) = about {
        command = command.about(unescaped(&about));
    }
    if let Some(long) = long {
        command = command.long_about(unescaped(&long));
    }
    let arguments = command.mut_args(|argument| {
        let help = argument.get_help().map(ToString::to_string);
        let long = argument.get_long_help().map(ToString::to_string);
        let mut argument = argument;
        if let Some(help) = help {
            argument = argument.help(unescaped(&help));
        }
        if let Some(long) = long {
            argument = argument.long_help(unescaped(&long));
        }
        argument
    });
    arguments.mut_subcommands(plain)
}

fn unescaped(text: &str) -> String {
    text.replace("\\[", "[").replace("\\]", "]")
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::cli::Cli;

    /// The help of a command and of all below it, short and long.
    fn all_help(command: &mut Command, out: &mut Vec<String>) {
        out.push(command.render_help().to_string());
        out.push(command.render_long_help().to_string());
        for below in command.get_subcommands_mut() {
            all_help(below, out);
        }
    }

    #[test]
    fn no_help_shows_a_backslash() {
        let mut pages = Vec::new();
        all_help(&mut plain(Cli::command()), &mut pages);
        assert!(pages.len() > 10, "{} pages", pages.len());
        let escaped: Vec<_> = pages.iter().filter(|page| page.contains('\\')).collect();
        assert!(escaped.is_empty(), "{escaped:#?}");
        let demo = pages.iter().find(|page| page.contains("--robots"));
        assert!(demo.is_some_and(|page| page.contains("[default: 5]")));
    }
}
