//! A board at a serial port.

use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

use super::claim::Claim;
use super::stream::{LEAST_TIMEOUT, TIMEOUT, ended, or_none};
use super::transport::Transport;

/// The speed of the serial port, baud; 8 data bits, no parity, one stop bit.
pub const BAUD: u32 = 921_600;

/// The serial ports of this computer: the path of each, and what is behind it as far as the system knows.
///
/// # Errors
/// A system that does not list its ports.
pub fn serial_ports() -> io::Result<Vec<(String, String)>> {
    let ports = serialport::available_ports()?;
    Ok(ports
        .into_iter()
        .map(|port| {
            let what = match port.port_type {
                serialport::SerialPortType::UsbPort(usb) => {
                    let name = usb.product.or(usb.manufacturer).unwrap_or_default();
                    format!("USB {:04x}:{:04x} {name}", usb.vid, usb.pid)
                }
                serialport::SerialPortType::BluetoothPort => "Bluetooth".to_owned(),
                serialport::SerialPortType::PciPort => "built in".to_owned(),
                serialport::SerialPortType::Unknown => String::new(),
            };
            (port.port_name, what.trim_end().to_owned())
        })
        .collect())
}

/// A serial port, such as a board's debugger offers.
pub struct SerialTransport {
    port: Box<dyn serialport::SerialPort>,
    path: String,
    opened: Instant,
    _claim: Claim,
}

impl SerialTransport {
    /// Opens a port by its path, such as `/dev/ttyACM0` or `COM3`, at [`BAUD`].
    ///
    /// # Errors
    /// A port that is not there, held by another program, or forbidden.
    pub fn open(path: &str) -> io::Result<Self> {
        let claim = Claim::port(path)?;
        let port = serialport::new(path, BAUD).timeout(TIMEOUT).open()?;
        Ok(Self {
            port,
            path: path.to_owned(),
            opened: Instant::now(),
            _claim: claim,
        })
    }
}

impl Transport for SerialTransport {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.set_timeout(TIMEOUT)?;
        self.port.write_all(bytes)?;
        self.port.flush()
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.port.set_timeout(timeout.max(LEAST_TIMEOUT))?;
        match self.port.read(buffer) {
            // A port that is there gives bytes or times out; the end of it is a cable that was pulled.
            Ok(0) => Err(ended()),
            read => or_none(read),
        }
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }

    fn endpoint(&self) -> String {
        format!("serial port {}", self.path)
    }

    fn remedy(&self) -> &'static str {
        "check that the board has power and Quadrant's firmware (`quadrant connect flash`), and that this is its port"
    }
}
