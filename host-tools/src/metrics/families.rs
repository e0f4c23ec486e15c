//! Families of metrics, each with its help and its type.

use prometheus::TextEncoder;
use prometheus::proto::{Counter, Gauge, LabelPair, Metric, MetricFamily, MetricType};

/// Families in their order. Their names begin with `flexid_`.
#[derive(Debug, Default)]
pub(crate) struct Families(Vec<MetricFamily>);

/// Labels of a sample: names and values.
type Labels<'a> = &'a [(&'a str, &'a str)];

impl Families {
    /// Appends a gauge without labels.
    pub(crate) fn gauge(&mut self, name: &str, help: &str, value: f64) {
        self.gauges(name, help, [(&[][..], value)]);
    }

    /// Appends gauges with labels; nothing without samples.
    pub(crate) fn gauges<'a>(
        &mut self,
        name: &str,
        help: &str,
        samples: impl IntoIterator<Item = (Labels<'a>, f64)>,
    ) {
        let samples = samples.into_iter().map(|(labels, value)| {
            let (mut gauge, mut metric) = (Gauge::default(), metric(labels));
            gauge.set_value(value);
            metric.set_gauge(gauge);
            metric
        });
        self.push(name, help, MetricType::GAUGE, samples.collect());
    }

    /// Appends a counter without labels.
    pub(crate) fn counter(&mut self, name: &str, help: &str, number: u64) {
        self.push(name, help, MetricType::COUNTER, vec![counted(&[], number)]);
    }

    /// Appends counters that differ by one label.
    pub(crate) fn counters<const N: usize>(
        &mut self,
        name: &str,
        help: &str,
        label: &str,
        samples: [(&str, u64); N],
    ) {
        let samples = samples.map(|(value, number)| counted(&[(label, value)], number));
        self.push(name, help, MetricType::COUNTER, samples.into());
    }

    /// Returns the families as text.
    pub(crate) fn text(&self) -> String {
        let text = TextEncoder::new().encode_to_string(&self.0);
        text.expect("each family has a name and a sample")
    }

    fn push(&mut self, name: &str, help: &str, kind: MetricType, samples: Vec<Metric>) {
        if samples.is_empty() {
            return;
        }
        let mut family = MetricFamily::default();
        family.set_name(format!("flexid_{name}"));
        family.set_help(help.to_owned());
        family.set_field_type(kind);
        family.set_metric(samples);
        self.0.push(family);
    }
}

fn counted(labels: Labels, number: u64) -> Metric {
    let (mut counter, mut metric) = (Counter::default(), metric(labels));
    counter.set_value(number as f64);
    metric.set_counter(counter);
    metric
}

fn metric(labels: Labels) -> Metric {
    let labels = labels.iter().map(|(name, value)| {
        let mut label = LabelPair::default();
        label.set_name((*name).to_owned());
        label.set_value((*value).to_owned());
        label
    });
    Metric::from_label(labels.collect())
}
