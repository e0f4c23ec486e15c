//! `flexid watch` where there is no daemon.

use std::io::{Read as _, Write as _};
use std::os::unix::net::UnixListener;
use std::{fs, thread};

use crate::setup::{flexid, folder, stderr};

#[test]
fn watch_says_why_it_cannot_listen() {
    let folder = folder();
    let output = flexid(folder.path(), "watch unix:flexid.sock");
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("unix:flexid.sock: nobody listens there"),
        "{}",
        stderr(&output)
    );

    // Somebody who hangs up, and somebody who talks of something else.
    for (answer, said) in [
        (&b""[..], "hung up"),
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", "does not speak flexid's protocol"),
    ] {
        let socket = folder.path().join("other.sock");
        let listener = UnixListener::bind(&socket).unwrap();
        let stranger = thread::spawn(move || {
            let (mut client, _) = listener.accept().unwrap();
            let _ = client.read(&mut [0; 64]);
            client.write_all(answer).unwrap();
        });
        let output = flexid(folder.path(), "watch unix:other.sock --until identified --timeout 5");
        stranger.join().unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains(said), "{:?} is not {said:?}", stderr(&output));
        assert_eq!(stderr(&output).lines().count(), 1);
        fs::remove_file(&socket).unwrap();
    }
}
