//! Connections of browsers. Number, size of a request and patience are bounded, so that nobody can use up the server.

use std::io;
use std::net::IpAddr;
use std::time::Duration;

use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use socket2::SockRef;
use tokio::net::{TcpListener, TcpStream};
use tokio_io_timeout::TimeoutStream;

use super::slots::Slots;

/// Most connections, in all and from one address. Chosen: a browser opens six.
const CONNECTIONS: (usize, usize) = (128, 64);
/// Largest request head, bytes. Chosen: browsers send one thousand; the crate takes no less than eight thousand.
const HEAD: usize = 16 * 1024;
/// Longest time that a client may take to send a request, or to be idle after one.
const REQUEST: Duration = Duration::from_secs(10);
/// Longest time for which a client may take nothing.
const TAKE: Duration = Duration::from_secs(10);
/// Bytes that the kernel keeps for a client that takes nothing, bytes. Chosen: a few pages.
const UNSENT: usize = 256 * 1024;
/// Pause after an error of the kernel, which may lack descriptors.
const PAUSE: Duration = Duration::from_millis(200);

/// Address of a client.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peer(pub(super) IpAddr);

/// Serves every connection to `listener`. It does not return.
pub(crate) async fn serve(listener: TcpListener, router: Router) {
    let slots = Slots::new(CONNECTIONS.0, CONNECTIONS.1);
    loop {
        let Ok((stream, address)) = listener.accept().await else {
            tokio::time::sleep(PAUSE).await;
            continue;
        };
        // One connection too many is closed.
        let Some(slot) = slots.take(address.ip()) else { continue };
        let router = router.clone().layer(Extension(Peer(address.ip())));
        tokio::spawn(async move {
            // A client may go at any time, and nobody here reads why.
            let _ = connection(stream, router).await;
            drop(slot);
        });
    }
}

async fn connection(stream: TcpStream, router: Router) -> io::Result<()> {
    let socket = SockRef::from(&stream);
    socket.set_send_buffer_size(UNSENT)?;
    // The kernel finds out who is gone without a farewell.
    socket.set_tcp_user_timeout(Some(2 * TAKE))?;
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(TAKE));
    http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(REQUEST)
        .max_buf_size(HEAD)
        .serve_connection(TokioIo::new(Box::pin(stream)), TowerToHyperService::new(router))
        .await
        .map_err(io::Error::other)
}
