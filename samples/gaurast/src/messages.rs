//! The driver's messages. A warning is printed once; an error becomes the command's last sentence.

use std::sync::{Mutex, PoisonError};

use gaurast_render::Message;

/// The different messages so far, in order.
static MESSAGES: Mutex<Vec<Message>> = Mutex::new(Vec::new());

/// Receives a message of the driver.
pub fn receive(message: &Message) {
    let mut messages = MESSAGES.lock().unwrap_or_else(PoisonError::into_inner);
    if messages.contains(message) {
        return;
    }
    if !message.is_error {
        eprintln!("gaurast: {}", message.text);
    }
    messages.push(message.clone());
}

/// The text of the last error so far.
pub fn last_error() -> Option<String> {
    let messages = MESSAGES.lock().unwrap_or_else(PoisonError::into_inner);
    let mut errors = messages.iter().filter(|message| message.is_error);
    errors.next_back().map(|error| error.text.clone())
}
