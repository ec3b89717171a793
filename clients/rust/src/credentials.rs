//! How a robot shows who it is, and knows whom it talks to.

use std::fmt;
use std::path::{Path, PathBuf};

use zenoh::Config;

/// What a robot shows to the Zenoh router, and how it knows the router. `docs/security.md` of the
/// project has an example with the files of both sides.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct Credentials {
    user: Option<(String, String)>,
    root_certificate: Option<PathBuf>,
    client_certificate: Option<(PathBuf, PathBuf)>,
    config_file: Option<PathBuf>,
}

impl Credentials {
    /// A user with its password.
    #[must_use]
    pub fn user(mut self, user: &str, password: &str) -> Self {
        self.user = Some((user.to_owned(), password.to_owned()));
        self
    }

    /// File (PEM) with the certificate of the authority that has signed the router's: for `tls/`
    /// endpoints.
    #[must_use]
    pub fn root_certificate(mut self, file: impl AsRef<Path>) -> Self {
        self.root_certificate = Some(file.as_ref().to_owned());
        self
    }

    /// Files (PEM) with the robot's own certificate and its key, where the router asks for one.
    #[must_use]
    pub fn client_certificate(
        mut self,
        certificate: impl AsRef<Path>,
        key: impl AsRef<Path>,
    ) -> Self {
        self.client_certificate = Some((certificate.as_ref().to_owned(), key.as_ref().to_owned()));
        self
    }

    /// A Zenoh configuration file (JSON5) for everything else. The other credentials and the
    /// endpoints are put over it.
    #[must_use]
    pub fn config_file(mut self, file: impl AsRef<Path>) -> Self {
        self.config_file = Some(file.as_ref().to_owned());
        self
    }

    /// The Zenoh configuration that they make.
    pub(crate) fn config(&self) -> zenoh::Result<Config> {
        let mut config = match &self.config_file {
            Some(file) => Config::from_file(file)?,
            None => Config::default(),
        };
        let mut insert =
            |key: &str, value: serde_json::Value| config.insert_json5(key, &value.to_string());
        if let Some((user, password)) = &self.user {
            insert("transport/auth/usrpwd/user", user.as_str().into())?;
            insert("transport/auth/usrpwd/password", password.as_str().into())?;
        }
        let path = |file: &Path| file.to_string_lossy().into_owned().into();
        if let Some(file) = &self.root_certificate {
            insert("transport/link/tls/root_ca_certificate", path(file))?;
        }
        if let Some((certificate, key)) = &self.client_certificate {
            insert("transport/link/tls/connect_certificate", path(certificate))?;
            insert("transport/link/tls/connect_private_key", path(key))?;
            insert("transport/link/tls/enable_mtls", true.into())?;
        }
        Ok(config)
    }
}

impl fmt::Debug for Credentials {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Never the password.
        f.debug_struct("Credentials")
            .field("user", &self.user.as_ref().map(|(user, _)| user))
            .field("root_certificate", &self.root_certificate)
            .field("client_certificate", &self.client_certificate)
            .field("config_file", &self.config_file)
            .finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn credentials_become_zenoh_settings_and_the_password_is_not_shown() {
        let credentials = Credentials::default()
            .user("ada", "s3cret")
            .root_certificate("/etc/ca.pem")
            .client_certificate("/etc/ada.pem", "/etc/ada.key");
        let config = credentials.config().unwrap();
        for (key, value) in [
            ("transport/auth/usrpwd/user", "\"ada\""),
            ("transport/auth/usrpwd/password", "\"s3cret\""),
            ("transport/link/tls/root_ca_certificate", "\"/etc/ca.pem\""),
            ("transport/link/tls/connect_certificate", "\"/etc/ada.pem\""),
            ("transport/link/tls/connect_private_key", "\"/etc/ada.key\""),
            ("transport/link/tls/enable_mtls", "true"),
        ] {
            assert_eq!(config.get_json(key).unwrap(), value, "{key}");
        }
        let shown = format!("{credentials:?}");
        assert!(
            shown.contains("ada") && !shown.contains("s3cret"),
            "{shown}"
        );
        let missing = Credentials::default().config_file("/nowhere/zenoh.json5");
        assert!(missing.config().is_err());
    }
}
