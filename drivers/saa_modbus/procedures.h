#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>

#include "core/base/inline_bytes.h"
#include "core/device/device.h"
#include "core/device/operation.h"
#include "core/device/step.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_modbus/codec.h"
#include "drivers/saa_modbus/interpreter.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

// The next step of a procedure.
struct WaitUntil {
  MonoNs until = 0;
};
struct ReadAt {  // the position; the device decides how many registers are asked for
  std::uint8_t address = 0;
};
struct Send {
  Frame request;
};
struct PortBaud {
  std::int64_t baud = 0;
};
using Want = std::variant<WaitUntil, ReadAt, Send, PortBaud>;

// The steps of one command on this protocol.
class Procedure : public CommandProcedure {
 public:
  [[nodiscard]] virtual Want Next(MonoNs now) const = 0;
  // Begins the exchange that Next returned. Returns the final outcome if this ends the procedure.
  virtual std::optional<Outcome> OnStarted([[maybe_unused]] Bytes request, [[maybe_unused]] MonoNs now) {
    return std::nullopt;
  }
  // The exchange is over at `end`. An outcome: progress, or the final one.
  virtual std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) = 0;
  // The port now has the rate that Next returned.
  virtual void OnRetuned([[maybe_unused]] MonoNs now) {}
};

// Readings that may fail in a row.
inline constexpr int kTries = 3;

// Looks at which of two places, a baud rate and an address each, the encoder answers: first `first`, then `second`.
class Search {
 public:
  struct Place {
    std::uint8_t address = 0;
    std::int64_t baud = 0;
  };
  enum class Progress : std::uint8_t { kGoing, kFirst, kSecond, kNowhere };

  // How long the encoder may take to listen at its new place is not documented.
  static constexpr MonoNs kSettle = 50 * kMillisecond;

  Search(Place first, Place second, const Connection& connection)
      : places_{first, second}, connection_(connection) {}

  // Not before `from`.
  void Start(MonoNs from) { due_ = from; }
  [[nodiscard]] Want Next(MonoNs now) const;
  void OnRetuned(MonoNs now) { due_ = now + kSettle; }
  [[nodiscard]] Progress OnAnswer(const Answer& answer);
  [[nodiscard]] std::uint32_t counts() const { return counts_; }  // when it was found

 private:
  [[nodiscard]] const Place& place() const { return places_.at(tried_); }

  std::array<Place, 2> places_;
  const Connection& connection_;
  std::size_t tried_ = 0;
  int failures_ = 0;
  MonoNs due_ = 0;
  std::uint32_t counts_ = 0;
};

// Sets the position to zero or the counting direction (CC 00, 01, 02): a reading, the request once, a reading. The
// shaft must stand still before the first reading and before the request. The encoder's echo shows that the
// setting was accepted (SAA manual 5.1.7: "Sending a return match ... was set successfully"); a zero is verified by
// reading, a direction cannot be without motion.
class DatumWrite final : public Procedure {
 public:
  // `parameter`: kZero, kPositive or kNegative.
  DatumWrite(Parameter parameter, const SaaModbusSettings& settings, const Connection& connection,
             const DeviceOutput& output);

  [[nodiscard]] Want Next(MonoNs now) const override;
  std::optional<Outcome> OnStarted(Bytes request, MonoNs now) override;
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return sent_; }

  // A zero whose effect does not show yet is read again.
  static constexpr MonoNs kReadAgain = 20 * kMillisecond;
  static constexpr int kLooks = 5;
  // Readings after the request that may fail.
  static constexpr int kReadsAfter = 10;

 private:
  enum class Stage : std::uint8_t { kReadBefore, kSend, kReadAfter };

  [[nodiscard]] bool AtRest(MonoNs now) const;
  [[nodiscard]] bool IsZero(std::int64_t counts) const;
  [[nodiscard]] bool SameBefore() const;
  std::optional<Outcome> OnBefore(const Answer& answer);
  std::optional<Outcome> OnAfter(const Answer& answer, MonoNs end);
  [[nodiscard]] Outcome JudgeZero(std::int64_t counts) const;
  [[nodiscard]] Outcome JudgeDirection(std::int64_t counts) const;
  [[nodiscard]] Outcome WithCounts(Outcome outcome, const std::string& after) const;

  const Parameter parameter_;
  const SaaModbusSettings& settings_;
  const Connection& connection_;
  const DeviceOutput& output_;
  Stage stage_ = Stage::kReadBefore;
  MonoNs due_ = 0;
  std::int64_t before_ = 0;
  bool sent_ = false;
  bool accepted_ = false;  // the echo came
  int failures_ = 0;
  int looks_ = 0;
};

// One reading of the position, shown.
class ReadPosition final : public Procedure {
 public:
  // `after`: the datum write whose effect is looked for, or nothing.
  ReadPosition(std::optional<Parameter> after, const SaaModbusSettings& settings, const Connection& connection,
               const DeviceOutput& output)
      : after_(after), settings_(settings), connection_(connection), output_(output) {}

  [[nodiscard]] Want Next(MonoNs) const override { return ReadAt{connection_.address}; }
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override;
  [[nodiscard]] Outcome OnLinkLost() const override;

 private:
  [[nodiscard]] const char* Finding(std::int64_t counts, MonoNs now) const;

  const std::optional<Parameter> after_;
  const SaaModbusSettings& settings_;
  const Connection& connection_;
  const DeviceOutput& output_;
  int failures_ = 0;
};

// Looks whether the encoder answers at another baud rate or address than it did, and follows it there.
class FindEncoder final : public Procedure {
 public:
  // `after`: the operation whose effect is looked for, for the text.
  FindEncoder(Search::Place changed, std::string after, const SaaModbusSettings& settings, Connection& connection);

  [[nodiscard]] Want Next(MonoNs now) const override { return search_.Next(now); }
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override;
  void OnRetuned(MonoNs now) override { search_.OnRetuned(now); }
  [[nodiscard]] Outcome OnLinkLost() const override;

 private:
  const Search::Place changed_;
  const std::string after_;
  const SaaModbusSettings& settings_;
  Connection& connection_;
  Search search_;
};

// Asks the only connected encoder for its address (FF A0).
class AskAddress final : public Procedure {
 public:
  explicit AskAddress(const Connection& connection) : connection_(connection) {}

  [[nodiscard]] Want Next(MonoNs) const override { return Send{QueryRequest()}; }
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override;
  [[nodiscard]] Outcome OnLinkLost() const override;

 private:
  const Connection& connection_;
  int failures_ = 0;
};

}  // namespace axlecast::saa_modbus
