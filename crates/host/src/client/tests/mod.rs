//! The client before a model of the machine.

mod exchange;
mod lines;
mod model;
mod observe;
mod session;
mod shared;

use std::cell::RefCell;
use std::rc::Rc;

use model::{Bench, Model};

use super::session::Client;
use crate::machine::Loopback;

fn connected() -> (Client, Rc<RefCell<Bench>>) {
    let (model, bench) = Model::new();
    (Client::open(Loopback::new(model)).unwrap(), bench)
}
