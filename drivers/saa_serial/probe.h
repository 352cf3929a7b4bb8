#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/kit/asking_probe.h"
#include "drivers/saa_serial/stream_parser.h"

namespace axlecast::saa_serial {

// Listens for an encoder that sends by itself; transmits nothing.
class StreamProbe final : public Probe {
 public:
  explicit StreamProbe(MonoNs now);

  [[nodiscard]] std::optional<Step> Next(MonoNs now) const override;
  void On(const Event& event) override;
  [[nodiscard]] std::vector<ProbeHit> Findings() const override;
  [[nodiscard]] double Progress() const override;

 private:
  // What the bytes are when frames have this many data bytes.
  struct Reading {
    explicit Reading(int most_bits) : bits(most_bits), parser(most_bits) {}

    int bits;
    StreamParser parser;
    std::int64_t frames = 0;
    std::uint32_t positions = 0;  // every bit that was ever set
    std::optional<StreamParser::Found> first;
    std::optional<StreamParser::Found> last;
  };

  void Take(Reading& reading, Bytes bytes, Interval at);
  [[nodiscard]] std::optional<ProbeHit> Judge(const Reading& reading) const;

  MonoNs until_;
  MonoNs now_;
  bool lost_ = false;
  std::int64_t bytes_ = 0;
  std::array<Reading, 3> readings_;
};

// Asks one address after the other of a polled bus (BC AA BX). Such a request has no checksum, and one of its
// relatives clears an encoder to zero: so only at a rate that the operator names.
class PolledProbe final : public AskingProbe {
 public:
  PolledProbe(const LineFormat& line, int first, int last) : line_(line), first_(first), last_(last), x_(first) {}

  [[nodiscard]] std::vector<ProbeHit> Findings() const override { return findings_; }
  [[nodiscard]] double Progress() const override;

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override;
  void Judge(const Event& event) override;

 private:
  void Add();

  LineFormat line_;
  int first_;
  int last_;
  int x_;
  int tries_ = 0;
  int answered_ = 0;  // alike in length and header
  int bits_ = 0;      // the most that fit the answers' length
  std::uint8_t header_ = 0;
  std::uint32_t positions_ = 0;
  std::vector<ProbeHit> findings_;
};

}  // namespace axlecast::saa_serial

namespace axlecast {

// For FamilyProbes.
[[nodiscard]] std::vector<ProbeTrial> saa_serial_probe(const ProbeScope& scope);

}  // namespace axlecast
