//! Texts of a machine on one line: a line's end in one would make a line of its own where it is shown.

use heapless::String;
use quadrant_link::message::{Event, LinkError, Notice, Reply};

/// Puts a space in place of a line's end or a tab.
fn flatten<const N: usize>(text: &mut String<N>) {
    if text.contains(is_break) {
        *text = text
            .chars()
            .map(|sign| if is_break(sign) { ' ' } else { sign })
            .collect();
    }
}

const fn is_break(sign: char) -> bool {
    matches!(sign, '\n' | '\r' | '\t')
}

/// Puts the texts of an answer on one line each.
pub(super) fn flatten_answer(answer: &mut Result<Reply, LinkError>) {
    match answer {
        Ok(Reply::Identity(identity)) => {
            flatten(&mut identity.firmware);
            flatten(&mut identity.board);
        }
        Ok(Reply::Fault(Some(fault))) => {
            flatten(&mut fault.name);
            flatten(&mut fault.cause);
            flatten(&mut fault.remedy);
        }
        Ok(Reply::Inputs(inputs)) => {
            if let Some(refusal) = &mut inputs.refusal {
                flatten(refusal);
            }
        }
        Ok(Reply::Provenance(text)) => flatten(text),
        Ok(Reply::Paths(page)) => page.paths.iter_mut().for_each(flatten),
        Err(
            LinkError::Unsupported(text)
            | LinkError::Busy(text)
            | LinkError::Refused(text)
            | LinkError::Invalid(text)
            | LinkError::Storage(text),
        ) => flatten(text),
        _ => {}
    }
}

/// Puts the text of a notice on one line.
pub(super) fn flatten_notice(notice: &mut Notice) {
    if let Notice::Log(text)
    | Notice::Event {
        event: Event::Started(text) | Event::Refused(text),
        ..
    } = notice
    {
        flatten(text);
    }
}
