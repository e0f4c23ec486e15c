//! Keys that are pressed, read as they come, without Enter and without waiting.

use std::io::{self, IsTerminal as _, Stdin, stdin};

use nix::sys::termios::{
    LocalFlags, SetArg, SpecialCharacterIndices, Termios, tcgetattr, tcsetattr,
};
use nix::unistd::{getpgrp, read, tcgetpgrp};

/// A key that the live pages know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Key {
    /// The page of this number, from 0.
    Page(usize),
    Next,
    Previous,
    Up,
    Down,
    PageUp,
    PageDown,
    Quit,
}

/// The terminal of standard input, in a mode without echo. Dropping it restores the mode.
pub(crate) struct Keys {
    input: Stdin,
    before: Termios,
}

impl Keys {
    /// Takes the terminal; `None` if standard input is none, or if another program has it.
    pub(crate) fn new() -> Option<Self> {
        let input = stdin();
        // A program in the background that sets the mode is stopped.
        if !input.is_terminal() || tcgetpgrp(&input) != Ok(getpgrp()) {
            return None;
        }
        let before = tcgetattr(&input).ok()?;
        let mut mode = before.clone();
        // Ctrl-C stays a signal.
        mode.local_flags.remove(LocalFlags::ICANON | LocalFlags::ECHO);
        mode.control_chars[SpecialCharacterIndices::VMIN as usize] = 0;
        mode.control_chars[SpecialCharacterIndices::VTIME as usize] = 0;
        tcsetattr(&input, SetArg::TCSANOW, &mode).ok()?;
        Some(Self { input, before })
    }

    /// The keys that were pressed since the last call.
    ///
    /// # Errors
    /// The terminal is gone.
    pub(crate) fn pressed(&self) -> io::Result<Vec<Key>> {
        let mut bytes = [0; 64];
        let length = read(&self.input, &mut bytes)?;
        Ok(keys(&bytes[..length]))
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        // There is no remedy for a terminal that is gone.
        let _ = tcsetattr(&self.input, SetArg::TCSANOW, &self.before);
    }
}

/// The keys in what a terminal sends. Unknown ones are left out.
fn keys(mut bytes: &[u8]) -> Vec<Key> {
    const SEQUENCES: [(&[u8], Key); 10] = [
        (b"\x1b[A", Key::Up),
        (b"\x1b[B", Key::Down),
        (b"\x1b[C", Key::Next),
        (b"\x1b[D", Key::Previous),
        (b"\x1bOA", Key::Up),
        (b"\x1bOB", Key::Down),
        (b"\x1bOC", Key::Next),
        (b"\x1bOD", Key::Previous),
        (b"\x1b[5~", Key::PageUp),
        (b"\x1b[6~", Key::PageDown),
    ];
    let mut keys = Vec::new();
    while let [first, rest @ ..] = bytes {
        if let Some((sequence, key)) =
            SEQUENCES.iter().find(|(sequence, _)| bytes.starts_with(sequence))
        {
            keys.push(*key);
            bytes = &bytes[sequence.len()..];
            continue;
        }
        bytes = rest;
        match first {
            b'1'..=b'9' => keys.push(Key::Page(usize::from(first - b'1'))),
            b'\t' => keys.push(Key::Next),
            b'k' => keys.push(Key::Up),
            b'j' => keys.push(Key::Down),
            b' ' => keys.push(Key::PageDown),
            b'q' => keys.push(Key::Quit),
            // An unknown sequence ends with a letter or a tilde.
            b'\x1b' => {
                let end = rest
                    .iter()
                    .skip(1)
                    .position(|byte| byte.is_ascii_alphabetic() || *byte == b'~');
                bytes = end.map_or(&[], |end| &rest[end + 2..]);
            }
            _ => {}
        }
    }
    keys
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_letters_and_sequences() {
        let pressed = keys(b"2\x1b[B\x1bOA\t\x1b[6~ \x1b[15~xq");
        let expected =
            [Key::Page(1), Key::Down, Key::Up, Key::Next, Key::PageDown, Key::PageDown, Key::Quit];
        assert_eq!(pressed, expected);
        assert_eq!(keys(b"\x1b"), []);
        assert_eq!(keys(b"\x1b["), []);
    }
}
