//! PostgreSQL in a folder, reached by its Unix socket.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::{Running, until};

pub(crate) struct Postgres {
    pub(crate) folder: PathBuf,
    programs: PathBuf,
    running: Option<Running>,
}

impl Postgres {
    /// A new server, whose folder lies in this one.
    pub(crate) fn start_in(folder: &Path) -> Self {
        // It must not run as root, and its user must reach the folder.
        fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).unwrap();
        let versions = fs::read_dir("/usr/lib/postgresql").expect("apt-get install postgresql");
        let programs = versions.map(|own| own.unwrap().path().join("bin")).max().unwrap();
        let folder = folder.join("pg");
        fs::create_dir(&folder).unwrap();
        if is_root() {
            assert!(Command::new("chown").arg("postgres").arg(&folder).status().unwrap().success());
        }
        let mut own = Self { folder, programs, running: None };
        let mut initdb = own.program("initdb");
        initdb.args(["-D", "data", "-A", "trust", "-U", "postgres", "--no-sync"]);
        assert!(initdb.stdout(Stdio::null()).status().unwrap().success());
        own.start();
        own
    }

    fn program(&self, name: &str) -> Command {
        let program = self.programs.join(name);
        let mut command = match is_root() {
            false => Command::new(program),
            true => {
                let mut command = Command::new("setpriv");
                command
                    .args(["--reuid=postgres", "--regid=postgres", "--clear-groups"])
                    .arg(program);
                command
            }
        };
        command.current_dir(&self.folder).stdin(Stdio::null());
        command
    }

    pub(crate) fn start(&mut self) {
        let mut command = self.program("postgres");
        command.args(["-D", "data", "-c", "listen_addresses=", "-c"]);
        command.arg(format!("unix_socket_directories={}", self.folder.display()));
        let log =
            fs::File::options().append(true).create(true).open(self.folder.with_extension("log"));
        self.running = Some(Running(command.stderr(log.unwrap()).spawn().unwrap()));
        until("PostgreSQL answers", || self.try_ask("postgres", "select 1").ok());
    }

    /// Ends it at once, as a power cut would.
    pub(crate) fn kill(&mut self) {
        let quit = format!("kill -QUIT {}", self.running.as_ref().unwrap().0.id());
        assert!(Command::new("sh").args(["-c", &quit]).status().unwrap().success());
        let mut running = self.running.take().unwrap();
        running.0.wait().unwrap();
    }

    /// The words of a connection.
    pub(crate) fn words(&self, user: &str) -> String {
        format!("host={} user={user} dbname=postgres", self.folder.display())
    }

    /// Runs statements. Returns rows as lines, columns with a bar between them; or what psql says.
    pub(crate) fn try_ask(&self, user: &str, statements: &str) -> Result<String, String> {
        let mut command = Command::new("psql");
        command.args(["-qAtX", "-v", "ON_ERROR_STOP=1", "-c", statements]).arg(self.words(user));
        let output = command.output().expect("apt-get install postgresql-client");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap().trim().to_owned();
        if output.status.success() { Ok(text(output.stdout)) } else { Err(text(output.stderr)) }
    }

    pub(crate) fn ask(&self, statements: &str) -> String {
        self.try_ask("postgres", statements).unwrap()
    }
}

impl Drop for Postgres {
    fn drop(&mut self) {
        if self.running.is_some() {
            self.kill();
        }
    }
}

fn is_root() -> bool {
    let id = Command::new("id").arg("-u").output().unwrap();
    id.stdout.trim_ascii() == b"0"
}
