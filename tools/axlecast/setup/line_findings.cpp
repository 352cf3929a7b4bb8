#include "tools/axlecast/setup/line_findings.h"

#include "core/base/text.h"
#include "drivers/hal/adapter.h"

namespace axlecast {
namespace {

constexpr int kShortLatencyMs = 1;

std::string Hex(unsigned value) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (int shift = 12; shift >= 0; shift -= 4) text += kDigits[(value >> static_cast<unsigned>(shift)) & 0xFU];
  return text;
}

void AddSerial(const BusConfig& bus, FindingGroup& group) {
  const std::int64_t baud = bus.link.line.baud;
  const std::optional<TtyFacts> facts = ReadTtyFacts(bus.link.port);
  if (!facts) {
    group.findings.push_back({"adapter", "nothing is there", Verdict::kBad,
                              "plug it in, or correct link.port; lasting names stand in /dev/serial/by-id/"});
    return;
  }
  if (!facts->usb) {
    group.findings.push_back({"adapter", "no USB adapter: a port of this host", Verdict::kUnjudged, ""});
    return;
  }
  const AdapterVerdict verdict = CheckAdapter(*facts->usb, baud);
  group.findings.push_back(
      {"adapter",
       Hex(facts->usb->vendor) + ':' + Hex(facts->usb->product) + ", release " + Hex(facts->usb->release),
       verdict.baud > 0 ? Verdict::kGood : Verdict::kUnjudged, ""});
  group.findings.push_back(
      {"rate that its chip makes",
       verdict.baud > 0 ? Decimal(verdict.baud, 0) + " of " + std::to_string(baud) + " Bd"
                        : "not known for this chip",
       verdict.fits ? (verdict.text.empty() ? Verdict::kGood : Verdict::kAttention) : Verdict::kBad, verdict.text});
  const int latency = ReadLatency(facts->latency_timer);
  if (latency < 0) return;
  group.findings.push_back(
      {"latency timer", std::to_string(latency) + " ms",
       latency <= kShortLatencyMs ? Verdict::kGood : Verdict::kAttention,
       latency <= kShortLatencyMs ? "" : "1 ms: echo 1 > " + facts->latency_timer + " (as root)"});
}

}  // namespace

FindingGroup LineFindings(const BusConfig& bus) {
  FindingGroup group{"Line", {}};
  group.findings.push_back({"port", bus.link.port, Verdict::kUnjudged, ""});
  if (bus.simulate) {
    group.findings.push_back({"adapter", "simulated: neither adapter nor wire", Verdict::kUnjudged, ""});
    return group;
  }
  switch (bus.family->link) {
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      AddSerial(bus, group);
      break;
    case LinkKind::kCan:
      group.findings.push_back(
          {"bit rate", std::to_string(bus.link.bitrate) + " bit/s, which the driver checks at the interface",
           Verdict::kUnjudged, ""});
      break;
    case LinkKind::kSpi:
      group.findings.push_back(
          {"clock", std::to_string(SpiOf(bus).clock_hz) + " Hz asked of the controller", Verdict::kUnjudged, ""});
      break;
  }
  return group;
}

}  // namespace axlecast
