//! `flexid web`: what a running daemon finds, as a page in browsers.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::thread;
use std::time::Duration;

use anyhow::{Context as _, Result};
use flexid_console::exit::BadArgument;
use flexid_edge::console::{complain, print};
use flexid_pipeline::stop::Stop;

use crate::web::{connections, follow, service};
use flexid_edge::client;

/// Interval at which the command sees a signal.
const LOOK: Duration = Duration::from_millis(200);

/// The help text on use and exit status.
const USE: &str = "\
The page follows the daemon, also over its restarts. It has no password: whoever reaches the address can read it, and nobody can
change anything. Exit status: 0 when Ctrl-C or SIGTERM ends it; 2 for wrong arguments, or an address that cannot be listened on.

Examples:
  $ flexid web unix:flexid.sock
  http://127.0.0.1:8080/
  $ flexid web unix:/run/flexid/flexid.sock --listen 192.168.1.10:8080
  http://192.168.1.10:8080/";

#[derive(Debug, clap::Args)]
#[command(after_help = USE)]
pub(super) struct Args {
    /// The daemon: unix:PATH or tcp:IP:PORT
    address: String,
    /// Address at which browsers reach the page; port 0 takes a free one
    #[arg(long, value_name = "IP:PORT", default_value = "127.0.0.1:8080")]
    listen: SocketAddr,
    /// A name under which browsers reach the page, besides the address; may be repeated
    #[arg(long, value_name = "HOST")]
    name: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let address =
        client::address(&args.address).map_err(|error| BadArgument(format!("ADDRESS: {error}")))?;
    let listener = listen(args.listen)?;
    let bound = listener.local_addr().context("the address of the page is not known")?;
    let stop = Stop::on_signals().context("signals cannot be caught")?;
    let page = follow::begin(&address);
    let router = service::router(page.subscribe(), &args.name);
    if !bound.ip().is_loopback() {
        complain(&format!("note: without a password, whoever reaches {bound} can read the page"));
    }
    print(&format!("http://{bound}/\n"))?;
    // It ends with the process.
    thread::Builder::new()
        .name("flexid-follow".into())
        .spawn(move || follow::follow(&address, &page))
        .context("no thread for the connection to the daemon")?;
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_io()
        .enable_time()
        .build()
        .context("no runtime for the page")?;
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        tokio::spawn(connections::serve(listener, router));
        while !stop.requested() {
            tokio::time::sleep(LOOK).await;
        }
        Ok(())
    })
}

fn listen(address: SocketAddr) -> Result<TcpListener> {
    let refused = |error: io::Error| {
        let mend = match error.kind() {
            io::ErrorKind::AddrInUse => {
                "another program listens there: name another port".to_owned()
            }
            io::ErrorKind::AddrNotAvailable => {
                "this machine has no such address: see `ip address`".to_owned()
            }
            io::ErrorKind::PermissionDenied => "no permission: name a port above 1023".to_owned(),
            _ => error.to_string(),
        };
        BadArgument(format!("--listen {address}: {mend}"))
    };
    let listener = TcpListener::bind(address).map_err(refused)?;
    listener.set_nonblocking(true).context("the page's socket cannot be used")?;
    Ok(listener)
}
