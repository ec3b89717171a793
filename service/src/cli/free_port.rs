//! Free ports on this machine.

/// A port of the loopback interface that nobody has now.
///
/// # Errors
/// The system gives none.
pub fn free_port() -> std::io::Result<u16> {
    Ok(std::net::TcpListener::bind("127.0.0.1:0")?
        .local_addr()?
        .port())
}
