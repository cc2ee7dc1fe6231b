//! Frames and messages between a Quadrant servo controller and its host.
//!
//! No operating system, no heap, and nothing of the control law or the settings: firmware, host tools and programs of
//! third parties share this crate alone. `docs/link.md` specifies the protocol byte by byte.
//!
//! - [`message`]: requests, responses and notices;
//! - [`frame`]: a message as bytes on the line, and the receiver that finds frames in a stream of bytes;
//! - [`server`]: the server's end, which answers every request once;
//! - [`watch`]: the recognition of `Stop` and `Disable` where no other request can delay them.
//!
//! ```
//! use quadrant_link::frame::{self, FRAME_BYTES};
//! use quadrant_link::message::{Body, Reply, Request, Response};
//! use quadrant_link::server::LinkServer;
//!
//! // A client asks.
//! let mut buffer = [0; FRAME_BYTES];
//! let request = Request { id: 7, body: Body::Disable };
//! let sent = frame::encode(&request, &mut buffer)?;
//!
//! // A server takes the bytes as they come, and answers each request once.
//! let mut server = LinkServer::new();
//! let mut disabled = false;
//! let mut answers = sent.iter().filter_map(|&byte| {
//!     server.push(byte, |body| {
//!         disabled = matches!(body, Body::Disable);
//!         Ok(Reply::Done)
//!     })
//! });
//! assert_eq!(answers.next(), Some(Response { id: 7, result: Ok(Reply::Done) }));
//! assert_eq!(answers.next(), None);
//! assert!(disabled);
//! # Ok::<(), quadrant_link::frame::EncodeError>(())
//! ```
#![no_std]
#![forbid(unsafe_code)]

pub mod frame;
pub mod message;
pub mod server;
pub mod watch;

pub use heapless;

/// The version of the protocol, the first byte of every payload.
pub const PROTOCOL_VERSION: u8 = 1;
