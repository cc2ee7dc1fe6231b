//! Pages as files, as text and in a browser.

mod browser_page;
mod formats;
mod page;
mod sample;
