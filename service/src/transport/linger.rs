//! Takes from Zenoh's sockets the option to linger.
//!
//! Zenoh 1.10 has its sockets wait up to ten seconds, when they are closed, until what is left has
//! been sent. Where the other side has stopped reading that never happens, and the thread that
//! closes the socket is one of the two that receive for the whole session. Without the option the
//! system sends the rest by itself, and closing waits for nobody. Zenoh has no setting for it and
//! does not hand out its sockets: so they are looked for among the open files of the process, by
//! the option itself.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, IoSliceMut};
use std::mem::MaybeUninit;
use std::os::fd::{OwnedFd, RawFd};
use std::os::unix::net::UnixDatagram;
use std::time::Duration;

use rustix::net::{
    RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, recvmsg,
    sockopt::{set_socket_linger, socket_linger},
};
use sendfd::SendWithFd;

/// How often is looked: well within the ten seconds after which Zenoh closes silent sessions.
const INTERVAL: Duration = Duration::from_secs(1);

/// Looks for new sockets until it is dropped.
pub async fn forbid() {
    let mut known = BTreeSet::new();
    let mut ticks = tokio::time::interval(INTERVAL);
    loop {
        ticks.tick().await;
        let looked = tokio::task::spawn_blocking(move || {
            if let Err(error) = look(&mut known) {
                tracing::debug!(%error, "look for sockets that linger");
            }
            known
        });
        let Ok(still_known) = looked.await else {
            return;
        };
        known = still_known;
    }
}

/// Takes the option from those sockets that are not among the known ones, which are those that are
/// open afterwards. Sockets are known by what the system calls them.
fn look(known: &mut BTreeSet<String>) -> io::Result<()> {
    let mut open = BTreeSet::new();
    let (sender, receiver) = UnixDatagram::pair()?;
    for entry in fs::read_dir("/proc/self/fd")? {
        let path = entry?.path();
        let Some(number) = path
            .file_name()
            .and_then(|name| name.to_str()?.parse().ok())
        else {
            continue;
        };
        // One that has been closed meanwhile has no link.
        let Ok(link) = fs::read_link(&path) else {
            continue;
        };
        let name = link.to_string_lossy().into_owned();
        if name.starts_with("socket:") {
            if !known.contains(&name)
                && let Ok(socket) = own(number, &sender, &receiver)
                && socket_linger(&socket).is_ok_and(|linger| linger.is_some())
            {
                set_socket_linger(&socket, None)?;
            }
            open.insert(name);
        }
    }
    *known = open;
    Ok(())
}

/// An open file by its number, as one's own: sent to oneself, and refused by the system if there is
/// none of that number.
fn own(number: RawFd, sender: &UnixDatagram, receiver: &UnixDatagram) -> io::Result<OwnedFd> {
    sender.send_with_fd(&[0], &[number])?;
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut ancillary = RecvAncillaryBuffer::new(&mut space);
    let mut byte = [0];
    let mut bytes = [IoSliceMut::new(&mut byte)];
    recvmsg(
        receiver,
        &mut bytes,
        &mut ancillary,
        RecvFlags::CMSG_CLOEXEC,
    )?;
    let received = ancillary.drain().find_map(|message| match message {
        RecvAncillaryMessage::ScmRights(mut files) => files.next(),
        _ => None,
    });
    received.ok_or_else(|| io::ErrorKind::NotFound.into())
}

#[cfg(test)]
mod tests {
    use std::net::{TcpListener, TcpStream};

    use super::*;

    #[test]
    fn sockets_that_linger_no_longer_do_and_others_stay_as_they_are() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("bound");
        let stream = TcpStream::connect(address).expect("it listens");
        set_socket_linger(&stream, Some(Duration::from_secs(10))).expect("an option of TCP");
        let mut known = BTreeSet::new();
        look(&mut known).expect("the process knows its open files");
        assert_eq!(socket_linger(&stream).expect("an option of TCP"), None);
        assert!(!known.is_empty());
        // A socket that was seen is not looked at again, a new one is.
        set_socket_linger(&stream, Some(Duration::from_secs(10))).expect("an option of TCP");
        let later = TcpStream::connect(address).expect("it listens");
        set_socket_linger(&later, Some(Duration::from_secs(10))).expect("an option of TCP");
        look(&mut known).expect("the process knows its open files");
        assert!(socket_linger(&stream).expect("an option of TCP").is_some());
        assert_eq!(socket_linger(&later).expect("an option of TCP"), None);
    }
}
