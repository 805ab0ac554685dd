//! Errors of the lab, as the page shows them.

use std::fmt;

use serde::Serialize;
use standstill_scenario::FileError;
use thiserror::Error;

/// Reason why there is no answer.
#[derive(Clone, Debug, PartialEq, Serialize, Error)]
#[error("{message}")]
pub struct LabError {
    /// The key of the scenario that it is about, if it is about one.
    pub key: Option<String>,
    /// The fault and the requirement, in words.
    pub message: String,
}

impl LabError {
    /// Makes a request that the page never makes.
    pub fn request(message: impl fmt::Display) -> Self {
        Self { key: None, message: format!("not a request of the lab: {message}") }
    }

    /// Makes an error of any other kind from its message.
    pub fn of(message: impl fmt::Display) -> Self {
        Self { key: None, message: message.to_string() }
    }
}

impl From<FileError> for LabError {
    fn from(error: FileError) -> Self {
        let key = match &error {
            FileError::Key { key, .. } => Some(key.clone()),
            _ => None,
        };
        Self { key, message: error.to_string() }
    }
}
