//! The guest kernel that gives a bus where this kernel has none. It starts on every processor, and reports the
//! cause if it fails.
#![cfg(all(target_os = "linux", target_arch = "x86_64"))]

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, ensure};

/// A script that writes the registers of a stopped child with all but the last 64 bytes of their state, as User-Mode
/// Linux does on a processor whose state is larger than its buffer. Exit status: 0 if the kernel takes them, else the
/// error number.
const SHORT_WRITE: &str = r#"
import ctypes, os, signal, sys
libc = ctypes.CDLL(None, use_errno=True)
libc.ptrace.restype = ctypes.c_long
libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
TRACEME, CONT, GETREGSET, SETREGSET, XSTATE = 0, 7, 0x4204, 0x4205, 0x202
class iovec(ctypes.Structure):
    _fields_ = [("base", ctypes.c_void_p), ("length", ctypes.c_size_t)]
child = os.fork()
if child == 0:
    libc.ptrace(TRACEME, 0, None, None)
    os.kill(os.getpid(), signal.SIGSTOP)
    os._exit(0)
os.waitpid(child, 0)
state = ctypes.create_string_buffer(1 << 16)
vector = iovec(ctypes.addressof(state), len(state))
if libc.ptrace(GETREGSET, child, XSTATE, ctypes.addressof(vector)):
    sys.exit("the registers cannot be read: errno %d" % ctypes.get_errno())
vector.length -= 64
refused = libc.ptrace(SETREGSET, child, XSTATE, ctypes.addressof(vector))
error = ctypes.get_errno() if refused else 0
libc.ptrace(CONT, child, None, None)
os.waitpid(child, 0)
sys.exit(error)
"#;

const EFAULT: i32 = 14;

fn short_write(preload: &Path) -> Result<Option<i32>> {
    let mut python = Command::new("python3");
    let status = python.args(["-I", "-c", SHORT_WRITE]).env("LD_PRELOAD", preload).status();
    Ok(status.context("python3")?.code())
}

#[test]
fn registers_are_written_from_a_buffer_that_is_too_short() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let shim = folder.path().join("whole-xstate.so");
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/whole-xstate.c");
    let mut compiler = Command::new("cc");
    compiler.args(["-O2", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", source, "-o"]);
    ensure!(compiler.arg(&shim).status().context("cc")?.success());
    // Without the shim every kernel refuses the write. Otherwise this test proves nothing.
    ensure!(short_write(Path::new(""))? == Some(EFAULT));
    ensure!(short_write(&shim)? == Some(0));
    Ok(())
}

#[test]
fn a_guest_that_dies_says_why() -> Result<()> {
    let with_vcan = concat!(env!("CARGO_MANIFEST_DIR"), "/with-vcan");
    let mut command = Command::new(with_vcan);
    // The memory is too small for any kernel: 24 MB are enough where the addresses of its host leave few gaps, and too little for its programs.
    let command = command.arg("true").env("VCAN_WAY", "user-mode-linux").env("VCAN_MEMORY", "21M");
    let ended = command.output().context("tests/with-vcan")?;
    let errors = String::from_utf8_lossy(&ended.stderr);
    ensure!(ended.status.code() == Some(125), "{:?}\n{errors}", ended.status);
    ensure!(errors.contains("panic"), "{errors}");
    ensure!(errors.ends_with("User-Mode Linux ended before the command did\n"), "{errors}");
    Ok(())
}

#[test]
fn a_guest_has_terminals() -> Result<()> {
    let with_vcan = concat!(env!("CARGO_MANIFEST_DIR"), "/with-vcan");
    let mut command = Command::new(with_vcan);
    let command = command.args(["python3", "-I", "-c", "import pty; pty.openpty()"]);
    let ended = command.env("VCAN_WAY", "user-mode-linux").output().context("tests/with-vcan")?;
    let said = String::from_utf8_lossy(&ended.stdout);
    ensure!(ended.status.success(), "{:?}\n{said}", ended.status);
    Ok(())
}
