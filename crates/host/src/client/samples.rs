//! Samples of channels: from telemetry or a capture, in the channels' units.

use std::time::Duration;

use heapless::Vec as Bounded;
use quadrant_link::message::{Body, CaptureRequest, CaptureStatus, Reply, TelemetryRequest};
use quadrant_link::message::{CapturePhase, CaptureRecord, Trigger};
use quadrant_link::message::{
    Channel, MAX_CHANNELS, SERIAL_VALUES_PER_S, TelemetryBlock, WordKind,
};

use super::error::ClientError;
use super::session::Client;

/// Time in which the control interrupt gives back a capture that is disarmed.
const GIVE_BACK: Duration = Duration::from_millis(500);

/// Samples of some channels, evenly spaced but for samples that were lost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// Channels in the order of their words.
    pub channels: Vec<Channel>,
    /// Time from one sample to the next, s.
    pub sample_time_s: f64,
    /// Control ticks from one sample to the next.
    pub decimation: u16,
    /// The control tick of the first sample.
    pub first_tick: u32,
    /// The number of each sample, from zero: a gap is what was lost.
    pub numbers: Vec<u32>,
    /// A list for each channel, of a word for each sample.
    pub words: Vec<Vec<u32>>,
}

impl Samples {
    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// True if there are no samples.
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    /// Samples that were lost between the first and the last.
    pub fn lost(&self) -> u64 {
        match (self.numbers.first(), self.numbers.last()) {
            (Some(first), Some(last)) => u64::from(last - first) + 1 - self.len() as u64,
            _ => 0,
        }
    }

    /// Time of each sample from the first, s.
    pub fn time_s(&self) -> Vec<f64> {
        let first = self.numbers.first().copied().unwrap_or(0);
        self.numbers
            .iter()
            .map(|number| f64::from(number - first) * self.sample_time_s)
            .collect()
    }

    /// A channel's values in its own unit; a counter that wraps goes on past its end.
    pub fn values(&self, channel: usize) -> Vec<f64> {
        let (Some(&kind), Some(words)) = (self.channels.get(channel), self.words.get(channel))
        else {
            return Vec::new();
        };
        let counts = matches!(kind, Channel::Axis(..)) && kind.word_kind() == WordKind::Integer;
        let Some(first) = words.first().filter(|_| counts) else {
            return words.iter().map(|&word| kind.value(word)).collect();
        };
        let mut last = *first;
        let mut total = i64::from(last as i32);
        words
            .iter()
            .map(|&word| {
                total += i64::from(word.wrapping_sub(last) as i32);
                last = word;
                total as f64
            })
            .collect()
    }

    /// Keeps at most the first `most` samples.
    pub fn truncate(&mut self, most: usize) {
        self.numbers.truncate(most);
        for words in &mut self.words {
            words.truncate(most);
        }
    }

    /// The samples from the one of index `first` on.
    #[must_use]
    pub fn from(&self, first: usize) -> Self {
        let mut part = self.clone();
        part.keep_last(self.len().saturating_sub(first));
        part
    }

    /// Keeps at most the last `most` samples.
    fn keep_last(&mut self, most: usize) {
        let surplus = self.len().saturating_sub(most);
        if surplus == 0 {
            return;
        }
        let passed = self.numbers[surplus] - self.numbers[0];
        self.first_tick = self
            .first_tick
            .wrapping_add(passed.wrapping_mul(self.decimation.into()));
        self.numbers.drain(..surplus);
        for words in &mut self.words {
            words.drain(..surplus);
        }
    }

    fn new(client: &Client, channels: &[Channel], decimation: u16) -> Self {
        Self {
            channels: channels.to_vec(),
            sample_time_s: f64::from(decimation) / client.identity().rate_hz,
            decimation,
            words: vec![Vec::new(); channels.len()],
            ..Self::default()
        }
    }

    fn push(&mut self, number: u32, words: impl Iterator<Item = u32>) {
        self.numbers.push(number);
        for (channel, word) in self.words.iter_mut().zip(words) {
            channel.push(word);
        }
    }
}

/// The fewest control ticks between samples at which a serial port carries so many channels.
pub fn least_decimation(channels: usize, rate_hz: f64) -> u16 {
    let ticks = (channels as f64 * rate_hz / SERIAL_VALUES_PER_S).ceil();
    ticks.clamp(1.0, f64::from(u16::MAX)) as u16
}

fn selection(channels: &[Channel]) -> Result<Bounded<Channel, MAX_CHANNELS>, ClientError> {
    Bounded::from_slice(channels).map_err(|_| ClientError::TooLong {
        what: "channels",
        text: channels
            .iter()
            .map(ToString::to_string)
            .collect::<Vec<_>>()
            .join(","),
        length: channels.len(),
        most: MAX_CHANNELS,
    })
}

/// Telemetry that is under way.
#[derive(Debug)]
pub struct TelemetryRecorder {
    samples: Samples,
    generation: u8,
    /// The number of the first sample that came.
    first: Option<u32>,
}

impl TelemetryRecorder {
    /// Selects channels, to be sampled every `decimation` control ticks.
    ///
    /// # Errors
    /// A refused selection, or a connection that is broken.
    pub fn start(
        client: &mut Client,
        channels: &[Channel],
        decimation: u16,
    ) -> Result<Self, ClientError> {
        let request = TelemetryRequest::Select {
            channels: selection(channels)?,
            decimation,
        };
        match client.request(Body::Telemetry(request))? {
            Reply::Telemetry { generation } => Ok(Self {
                samples: Samples::new(client, channels, decimation),
                generation,
                first: None,
            }),
            other => Err(client.unexpected("telemetry", &other)),
        }
    }

    /// Takes the samples that come within `time`; other notices are left for other readers.
    ///
    /// # Errors
    /// A connection that is broken.
    pub fn gather(&mut self, client: &mut Client, time: Duration) -> Result<(), ClientError> {
        client.wait(time)?;
        for block in client.take_blocks() {
            self.take(&block);
        }
        Ok(())
    }

    /// Forgets all but the last `most` samples.
    pub fn keep_last(&mut self, most: usize) {
        self.samples.keep_last(most);
    }

    /// The samples so far.
    pub const fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Ends the selection, and gives its samples.
    ///
    /// # Errors
    /// A connection that is broken.
    pub fn finish(mut self, client: &mut Client) -> Result<Samples, ClientError> {
        self.stop(client)?;
        Ok(self.samples)
    }

    /// Ends the selection; the samples that have come stay, also after an error.
    ///
    /// # Errors
    /// A connection that is broken.
    pub fn stop(&mut self, client: &mut Client) -> Result<(), ClientError> {
        client.request(Body::Telemetry(TelemetryRequest::Stop))?;
        // What was sent before the answer.
        for block in client.take_blocks() {
            self.take(&block);
        }
        Ok(())
    }

    /// The samples that have come.
    pub fn into_samples(self) -> Samples {
        self.samples
    }

    fn take(&mut self, block: &TelemetryBlock) {
        let channels = self.samples.channels.len();
        if block.generation != self.generation || usize::from(block.channels) != channels {
            return;
        }
        let first = *self.first.get_or_insert(block.sequence);
        if self.samples.is_empty() {
            self.samples.first_tick = block.tick;
        }
        for (number, words) in block.samples() {
            self.samples.push(number.wrapping_sub(first), words);
        }
    }
}

/// Arms the capture; one that is waiting already, for a fault as after `enable`, is given up.
///
/// # Errors
/// A refused selection, or a connection that is broken.
pub fn arm(
    client: &mut Client,
    channels: &[Channel],
    decimation: u16,
    pre_trigger_percent: u8,
    trigger: Trigger,
) -> Result<CaptureStatus, ClientError> {
    let due = client.now() + GIVE_BACK;
    let mut status = capture_state(client)?;
    if is_recording(&status) {
        status = disarm(client)?;
    }
    while is_recording(&status) && client.now() < due {
        client.wait(Duration::from_millis(2))?;
        status = capture_state(client)?;
    }
    let request = CaptureRequest::Arm {
        channels: selection(channels)?,
        decimation,
        pre_trigger_percent,
        trigger,
    };
    capture(client, request)
}

const fn is_recording(status: &CaptureStatus) -> bool {
    matches!(status.phase, CapturePhase::Armed | CapturePhase::Triggered)
}

/// Reads the state of the capture.
///
/// # Errors
/// A connection that is broken.
pub fn capture_state(client: &mut Client) -> Result<CaptureStatus, ClientError> {
    capture(client, CaptureRequest::State)
}

/// Freezes what the capture holds.
///
/// # Errors
/// A connection that is broken.
pub fn disarm(client: &mut Client) -> Result<CaptureStatus, ClientError> {
    capture(client, CaptureRequest::Disarm)
}

fn capture(client: &mut Client, request: CaptureRequest) -> Result<CaptureStatus, ClientError> {
    match client.request(Body::Capture(request))? {
        Reply::Capture(status) => Ok(status),
        other => Err(client.unexpected("capture", &other)),
    }
}

/// Reads the capture, waiting until it is frozen for at most `timeout`.
///
/// # Errors
/// A capture that is not armed, that is not triggered in time, or that is armed again while it is read.
pub fn read_capture(
    client: &mut Client,
    timeout: Duration,
) -> Result<(Samples, CaptureRecord), ClientError> {
    let due = client.now() + timeout;
    let (status, record) = loop {
        let status = capture_state(client)?;
        if let Some(record) = status.record {
            break (status, record);
        }
        if status.phase == CapturePhase::Idle || client.now() >= due {
            return Err(ClientError::TimedOut {
                what: "capture",
                waited_s: timeout.as_secs_f64(),
                remedy: "`capture arm` makes it wait for its trigger, `capture state` says how far it is, \
                         `capture stop` freezes what there is",
            });
        }
        client.wait(Duration::from_millis(10))?;
    };
    let mut samples = Samples::new(client, &status.channels, status.decimation);
    samples.first_tick = record.first_tick;
    let channels = status.channels.len().max(1);
    let mut words: Vec<u32> = Vec::new();
    let all = record.samples as usize * channels;
    while words.len() < all {
        let offset = words.len() as u16;
        let page = match client.request(Body::Capture(CaptureRequest::Read { offset }))? {
            Reply::Words(page) => page,
            other => return Err(client.unexpected("capture", &other)),
        };
        if page.number != status.number || page.offset != offset || page.words.is_empty() {
            return Err(ClientError::Unexpected {
                what: "capture",
                endpoint: client.endpoint(),
                answer: "words of another capture: it was armed while it was read",
            });
        }
        words.extend(page.words.iter());
    }
    for (number, sample) in words.chunks_exact(channels).enumerate() {
        samples.push(number as u32, sample.iter().copied());
    }
    Ok((samples, record))
}
