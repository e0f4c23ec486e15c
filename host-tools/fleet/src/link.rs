//! A connection to an MQTT broker, version 5, whose acknowledgements say whether the broker lets this user write a topic.
//!
//! What was not acknowledged when the connection ends is forgotten here: whoever sends has it on disk, and sends it again.

use std::future::ready;
use std::io::{self, ErrorKind};
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use rumqttc::mqttbytes::QoS;
use rumqttc::mqttbytes::v5::{ConnectReturnCode, PubAckReason, Publish};
use rumqttc::{
    AckMode, Client, ConnectionError, Event, Incoming, LastWill, MqttOptions, PersistedAckMode,
    PersistedSession, PublishOptions, SessionStore, SessionStoreError, SessionStoreKey, StateError,
};

/// Interval between two attempts to connect: at first, and at most.
const RETRY: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(30)];
/// Interval after which a silent connection is tested. A broker sends the last will after one and a half of it.
const KEEP_ALIVE_S: u16 = 30;
/// Most messages in either direction that are not acknowledged.
const IN_FLIGHT: u16 = 20;

/// What a connection tells.
#[derive(Clone, Debug)]
pub enum Signal {
    /// The broker has accepted the client.
    Up,
    /// There is no connection: it could not be made, or has ended. The reason names the mend.
    Down(String),
    /// The broker has taken the oldest message of quality 1 that it had not acknowledged, or says why not.
    Acknowledged(Result<(), String>),
    /// A message has come.
    Message(Publish),
}

/// Access to a broker.
#[derive(Clone, Debug)]
pub struct Access {
    /// Address of the broker.
    pub address: SocketAddr,
    /// Name and password. `None` for a broker that asks for none.
    pub credentials: Option<(String, String)>,
}

/// A connection that is made anew whenever it ends.
pub struct Link {
    options: MqttOptions,
    address: SocketAddr,
    tell: Arc<dyn Fn(Signal) + Send + Sync>,
    client: Option<Client>,
    is_up: bool,
    next: Instant,
    pause: Duration,
}

impl Link {
    /// Makes a link that is not connected yet, with the client's name and a last will on a topic, which is retained. What happens is told.
    pub fn new(
        access: &Access,
        name: &str,
        will: Option<(String, String)>,
        tell: impl Fn(Signal) + Send + Sync + 'static,
    ) -> Self {
        let address = access.address;
        let mut options = MqttOptions::new(name, (address.ip().to_string(), address.port()));
        options.set_keep_alive(KEEP_ALIVE_S);
        // The client has a place for each message in flight, of 65,535 without a limit: 16 MB.
        options.set_outgoing_inflight_upper_limit(IN_FLIGHT).set_receive_maximum(Some(IN_FLIGHT));
        if let Some((user, password)) = &access.credentials {
            options.set_credentials(user.clone(), password.clone());
        }
        if let Some((topic, text)) = will {
            options.set_last_will(LastWill::new(topic, text, QoS::AtLeastOnce, true, None));
        }
        let tell = Arc::new(tell);
        let (next, pause) = (Instant::now(), RETRY[0]);
        Self { options, address, tell, client: None, is_up: false, next, pause }
    }

    /// Has the broker keep the subscriptions, and the messages for them that are not [acknowledged](Self::acknowledge), for ever. Messages
    /// larger than `largest` bytes it drops.
    pub fn keep_session(mut self, largest: u32) -> Self {
        let store = NothingInFlight(self.options.client_id());
        self.options
            .set_clean_start(false)
            .set_session_expiry_interval(Some(u32::MAX))
            .set_ack_mode(AckMode::Manual)
            .set_max_packet_size(Some(largest))
            .set_session_store(store);
        self
    }

    /// Returns whether the broker has accepted the client.
    pub fn is_up(&self) -> bool {
        self.is_up
    }

    /// Connects, if there is no connection and it is time for an attempt.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn keep(&mut self) -> io::Result<()> {
        if self.client.is_some() || Instant::now() < self.next {
            return Ok(());
        }
        let (client, mut connection) = Client::builder(self.options.clone()).capacity(256).build();
        let (tell, address) = (Arc::clone(&self.tell), self.address);
        thread::Builder::new().name("flexid-mqtt".into()).spawn(move || {
            let mut events = connection.iter();
            let reason = loop {
                match events.next() {
                    Some(Ok(Event::Incoming(packet))) => {
                        signal(packet).into_iter().for_each(&*tell)
                    }
                    Some(Ok(_)) => {}
                    Some(Err(error)) => break mend(&error),
                    None => break "the connection has ended".to_owned(),
                }
            };
            tell(Signal::Down(format!("mqtt {address}: {reason}")));
        })?;
        self.client = Some(client);
        Ok(())
    }

    /// Takes note of a signal of this link.
    pub fn hear(&mut self, signal: &Signal) {
        match signal {
            Signal::Up => (self.is_up, self.pause) = (true, RETRY[0]),
            Signal::Down(_) => {
                (self.client, self.is_up) = (None, false);
                self.next = Instant::now() + self.pause;
                self.pause = (2 * self.pause).min(RETRY[1]);
            }
            Signal::Acknowledged(_) | Signal::Message(_) => {}
        }
    }

    /// Sends a message with quality 1, or 0 if it need not arrive. Returns whether the connection has taken it.
    pub fn send(&self, topic: &str, text: impl Into<Vec<u8>>, quality: Quality) -> bool {
        let options = match quality {
            Quality::Retained => PublishOptions::new(QoS::AtLeastOnce).retained(),
            Quality::Once => PublishOptions::new(QoS::AtLeastOnce),
            Quality::Maybe => PublishOptions::new(QoS::AtMostOnce),
        };
        let sent = |client: &Client| client.try_publish(topic, text.into(), options).is_ok();
        self.is_up && self.client.as_ref().is_some_and(sent)
    }

    /// Asks for the messages of a topic. Returns whether the connection has taken the request.
    pub fn subscribe(&self, topic: &str) -> bool {
        let asked = |client: &Client| client.try_subscribe(topic, QoS::AtLeastOnce).is_ok();
        self.client.as_ref().is_some_and(asked)
    }

    /// Acknowledges a message. Returns whether the connection has taken it.
    pub fn acknowledge(&self, message: &Publish) -> bool {
        self.client.as_ref().is_some_and(|client| client.try_ack(message).is_ok())
    }

    /// Takes leave of the broker, which sends no last will then. [`Signal::Down`] follows.
    pub fn leave(&self) {
        if let Some(client) = &self.client {
            // It fails only where the connection has ended.
            let _ = client.try_disconnect();
        }
    }
}

/// The client's part of a session that the broker keeps: no message of its own is in flight when it connects. Without one, the library drops
/// each subscription and each message of quality 1 of a session that the broker kept, and says nothing.
#[derive(Debug)]
struct NothingInFlight(String);

type Stored<'a, T> = Pin<Box<dyn Future<Output = Result<T, SessionStoreError>> + Send + 'a>>;

impl SessionStore for NothingInFlight {
    fn load<'a>(&'a self, _: &'a SessionStoreKey) -> Stored<'a, Option<PersistedSession>> {
        Box::pin(ready(Ok(Some(PersistedSession {
            format_version: 1,
            client_id: self.0.clone(),
            clean_start: false,
            session_expiry_interval: Some(u32::MAX),
            outgoing_inflight_upper_limit: Some(IN_FLIGHT),
            ack_mode: PersistedAckMode::Manual,
            last_pkid: 0,
            last_puback: 0,
            replay: Vec::new(),
            incoming_qos2: Vec::new(),
        }))))
    }

    fn save<'a>(&'a self, _: &'a SessionStoreKey, _: &'a PersistedSession) -> Stored<'a, ()> {
        Box::pin(ready(Ok(())))
    }

    fn clear<'a>(&'a self, _: &'a SessionStoreKey) -> Stored<'a, ()> {
        Box::pin(ready(Ok(())))
    }
}

/// How a message is to arrive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// At least once, and retained as the newest of its topic.
    Retained,
    /// At least once.
    Once,
    /// At most once.
    Maybe,
}

fn signal(packet: Incoming) -> Option<Signal> {
    match packet {
        Incoming::ConnAck(_) => Some(Signal::Up),
        Incoming::Publish(message) => Some(Signal::Message(message)),
        Incoming::PubAck(acknowledgement) => {
            Some(Signal::Acknowledged(match acknowledgement.reason {
                PubAckReason::Success | PubAckReason::NoMatchingSubscribers => Ok(()),
                PubAckReason::NotAuthorized => {
                    Err("the broker does not let this user write it: correct its acl_file".into())
                }
                PubAckReason::QuotaExceeded => Err("the broker has no room: see its log".into()),
                reason => Err(format!("the broker refuses it ({reason:?}): see its log")),
            }))
        }
        _ => None,
    }
}

/// Returns why there is no connection, and the mend.
fn mend(error: &ConnectionError) -> String {
    use ConnectReturnCode::{BadUserNamePassword, NotAuthorized};
    match error {
        ConnectionError::Io(error) if error.kind() == ErrorKind::ConnectionRefused => {
            "nobody listens there: is mosquitto running, with this listener?".into()
        }
        ConnectionError::ConnectionRefused(BadUserNamePassword | NotAuthorized)
        | ConnectionError::MqttState(StateError::ConnFail {
            reason: BadUserNamePassword | NotAuthorized,
        }) => {
            "the broker refuses user and password: correct [broker] user and password_file".into()
        }
        ConnectionError::MqttState(StateError::ServerDisconnect { reason_code, .. }) => {
            match reason_code {
                rumqttc::mqttbytes::v5::DisconnectReasonCode::SessionTakenOver => {
                    "another client has this one's name: stop one of the two".into()
                }
                reason => format!("the broker ended the connection ({reason:?}): see its log"),
            }
        }
        error => format!("{error}: see the broker's log"),
    }
}
