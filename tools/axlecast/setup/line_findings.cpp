#include "tools/axlecast/setup/line_findings.h"

#include "core/base/text.h"
#include "drivers/hal/adapter.h"

namespace axlecast {
namespace {

constexpr int kShortLatencyMs = 1;

void AddSerial(const BusConfig& bus, FindingGroup& group) {
  const std::int64_t baud = bus.link.line.baud;
  const std::optional<TtyFacts> facts = ReadTtyFacts(bus.link.port);
  if (!facts) {
    group.Add("adapter", "nothing is there", Verdict::kBad,
              "plug it in, or correct link.port; permanent names are in /dev/serial/by-id/");
    return;
  }
  if (!facts->usb) {
    group.Add("adapter", "no USB adapter: a port of this host");
    return;
  }
  const AdapterVerdict verdict = CheckAdapter(*facts->usb, baud);
  group.Add("adapter",
            Text("%04x:%04x, release %04x", unsigned{facts->usb->vendor}, unsigned{facts->usb->product},
                 unsigned{facts->usb->release}),
            verdict.baud > 0 ? Verdict::kGood : Verdict::kUnjudged);
  group.Add("rate that its chip generates",
            verdict.baud > 0 ? Decimal(verdict.baud, 0) + " of " + std::to_string(baud) + " Bd"
                             : "not known for this chip",
            verdict.fits ? (verdict.text.empty() ? Verdict::kGood : Verdict::kAttention) : Verdict::kBad,
            verdict.text);
  const int latency = ReadLatency(facts->latency_timer);
  if (latency < 0) return;
  group.Add("latency timer", std::to_string(latency) + " ms",
            latency <= kShortLatencyMs ? Verdict::kGood : Verdict::kAttention,
            latency <= kShortLatencyMs ? "" : "1 ms: echo 1 > " + facts->latency_timer + " (as root)");
}

}  // namespace

FindingGroup LineFindings(const BusConfig& bus) {
  FindingGroup group{"Line", {}};
  group.Add("port", bus.link.port);
  if (bus.simulate) {
    group.Add("adapter", "simulated: neither adapter nor wire");
    return group;
  }
  switch (bus.family->link) {
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      AddSerial(bus, group);
      break;
    case LinkKind::kCan:
      group.Add("bit rate", std::to_string(bus.link.bitrate) + " bit/s, which the driver checks at the interface");
      break;
    case LinkKind::kSpi:
      group.Add("clock", std::to_string(SpiOf(bus).clock_hz) + " Hz requested from the controller");
      break;
  }
  return group;
}

}  // namespace axlecast
