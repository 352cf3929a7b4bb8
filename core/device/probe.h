#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/device/line_settings.h"
#include "core/device/step.h"

namespace axlecast {

enum class Confidence : std::uint8_t {
  kPossible,  // fits, and so would much else
  kLikely,    // fits in ways that few other devices would
  kSure,      // sent data that no other device sends
};

// A device that a probe has probably found.
struct ProbeHit {
  using Keys = std::vector<std::pair<std::string, std::string>>;  // a key and its value as YAML

  Confidence confidence = Confidence::kPossible;
  std::string device;  // what it is, for people: "SAA encoder, address 5"
  std::string reason;  // the evidence, and what remains uncertain
  Keys bus;            // the family's keys of the bus
  Keys keys;           // those of the device; none: known to be there, but nothing that could be configured
  std::string check;   // what the operator must look up and set; empty: nothing
};

// Searches for the devices of a family in one way (ProbeTrial), without I/O and clocks: Next returns the requested step, and
// On receives the events. It changes nothing in any device. One thread calls all functions.
class Probe {
 public:
  virtual ~Probe() = default;

  // Returns the step that the probe requests now; nothing when it has ended. The call changes nothing.
  [[nodiscard]] virtual std::optional<Step> Next(MonoNs now) const = 0;
  // Receives the result of its step, and every unexpected byte and link change.
  virtual void On(const Event& event) = 0;

  // Returns the hits so far.
  [[nodiscard]] virtual std::vector<ProbeHit> Findings() const = 0;
  // Returns true if another master transmits on the line. Then nothing more may be transmitted.
  [[nodiscard]] virtual bool Disturbed() const { return false; }
  // Returns the finished part, 0 to 1.
  [[nodiscard]] virtual double Progress() const = 0;
};

// The limits of the search, from the operator.
struct ProbeScope {
  std::vector<std::int64_t> rates;  // the only ones to try, baud or SPI clock; empty: those that a family has
  Parity parity = Parity::kNone;    // of a line whose parity is made to order
  int first_address = 0;            // of a bus with addresses, the only ones to ask
  int last_address = 255;

  // The rates to try of those that a family has.
  [[nodiscard]] std::vector<std::int64_t> RatesOf(std::vector<std::int64_t> usual) const {
    if (!rates.empty()) std::erase_if(usual, [this](std::int64_t rate) { return !Names(rate); });
    return usual;
  }
  [[nodiscard]] bool Names(std::int64_t rate) const {
    return std::find(rates.begin(), rates.end(), rate) != rates.end();
  }
};

// A reply to a probe's request comes at most this long after the request, also in a later trial: a probe whose requests go
// unanswered waits that long before it sends one whose reply looks alike.
inline constexpr MonoNs kLatestProbeReply = 500 * kMillisecond;

// One way to search for the devices of a family.
struct ProbeTrial {
  std::string what;          // for people: "Modbus, 19200 baud 8N1, addresses 1 to 32"
  bool asks = false;         // it transmits; otherwise it only receives
  LineFormat line = {};      // kSerial, kModbus
  std::int64_t bitrate = 0;  // kCan: that the interface runs at
  SpiSettings spi = {};      // kSpi
  MonoNs longest = 0;        // the maximum time if nothing answers
  std::function<std::unique_ptr<Probe>(MonoNs now)> make;  // that begins now
};

struct Family;

// The trials of a family. Its folder defines `std::vector<ProbeTrial> <folder>_probe(const ProbeScope&)`
// in namespace axlecast. It is not part of Family, because drivers do not need it.
struct FamilyProbe {
  const Family* family = nullptr;
  std::vector<ProbeTrial> (*trials)(const ProbeScope& scope) = nullptr;
};

// Of every family that was built. Defined by the build (cmake/axlecast.cmake).
[[nodiscard]] std::span<const FamilyProbe> FamilyProbes();

}  // namespace axlecast
