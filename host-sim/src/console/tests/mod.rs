//! The client before a model of the machine.

mod exchange;
mod lines;
mod model;
mod observe;
mod session;

use std::cell::RefCell;
use std::rc::Rc;

use super::client::Client;
use super::transport::InProcess;
use model::{Bench, Model};

fn connected() -> (Client, Rc<RefCell<Bench>>) {
    let (model, bench) = Model::new();
    (Client::open(InProcess::new(model)).unwrap(), bench)
}
