//! What crosses the border of the target: frames and messages.
//!
//! `docs/link.md` specifies the protocol byte by byte. Both sides use this code:
//!
//! ```
//! use quadrant::link::frame::{self, FRAME_BYTES};
//! use quadrant::link::message::{Body, Message, Reply, Request, Response};
//! use quadrant::link::port::Port;
//!
//! // A client asks.
//! let mut buffer = [0; FRAME_BYTES];
//! let request = Request { id: 7, body: Body::Disable };
//! let sent = frame::encode(&request, &mut buffer)?;
//!
//! // A server takes the bytes as they come, and answers each request once.
//! let mut port = Port::new();
//! let mut disabled = false;
//! let mut answers = sent.iter().filter_map(|&byte| {
//!     port.push(byte, |body| {
//!         disabled = matches!(body, Body::Disable);
//!         Ok(Reply::Done)
//!     })
//! });
//! assert_eq!(answers.next(), Some(Response { id: 7, result: Ok(Reply::Done) }));
//! assert_eq!(answers.next(), None);
//! assert!(disabled);
//! # Ok::<(), quadrant::link::frame::EncodeError>(())
//! ```

pub mod frame;
pub mod lockstep;
pub mod message;
pub mod port;

/// The version of the protocol, the first byte of every payload.
pub const PROTOCOL_VERSION: u8 = 1;
