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
  kSure,      // said things that nothing else says
};

// A device that a probe believes to have found.
struct ProbeHit {
  using Keys = std::vector<std::pair<std::string, std::string>>;  // a key and its value as YAML

  Confidence confidence = Confidence::kPossible;
  std::string device;  // what it is, for people: "SAA encoder, address 5"
  std::string reason;  // why it is believed, and what stays open
  Keys bus;            // the family's keys of the bus
  Keys keys;           // those of the device; none: known to be there, but nothing that could be configured
  std::string check;   // what the operator must look up and set; empty: nothing
};

// The search for a family's devices in one way (ProbeTrial), free of I/O and clocks as a Device is: it says what it
// wants, and is told what happened. It changes nothing in any device. One thread calls it.
class Probe {
 public:
  virtual ~Probe() = default;

  // What it wants now; nothing: it is through. Asking changes nothing.
  [[nodiscard]] virtual std::optional<Step> Next(MonoNs now) const = 0;
  // The outcome of its step, every stray byte and link change.
  virtual void On(const Event& event) = 0;

  // So far.
  [[nodiscard]] virtual std::vector<ProbeHit> Findings() const = 0;
  // Somebody else speaks on the line: nothing more must be asked on it.
  [[nodiscard]] virtual bool Disturbed() const { return false; }
  // How much of the whole is done, 0 to 1.
  [[nodiscard]] virtual double Progress() const = 0;
};

// What the operator has told about the line.
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

// One way to look for a family's devices.
struct ProbeTrial {
  std::string what;          // for people: "Modbus, 19200 baud 8N1, addresses 1 to 32"
  bool asks = false;         // transmits; else it only listens
  LineFormat line = {};      // kSerial, kModbus
  std::int64_t bitrate = 0;  // kCan: that the interface runs at
  SpiSettings spi = {};      // kSpi
  MonoNs longest = 0;        // how long it takes where nothing answers
  std::function<std::unique_ptr<Probe>(MonoNs now)> make;  // that begins now
};

struct Family;

// How a family's devices are looked for. Its folder defines `std::vector<ProbeTrial> <folder>_probe(const ProbeScope&)`
// in namespace axlecast. It is no part of Family, because drivers have no use for it.
struct FamilyProbe {
  const Family* family = nullptr;
  std::vector<ProbeTrial> (*trials)(const ProbeScope& scope) = nullptr;
};

// Of every family that was built. Defined by the build (cmake/axlecast.cmake).
[[nodiscard]] std::span<const FamilyProbe> FamilyProbes();

}  // namespace axlecast
