#pragma once

#include <string>

#include "core/device/device.h"
#include "drivers/saa_modbus/procedure.h"
#include "drivers/saa_modbus/search.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

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

// Asks whichever one encoder is connected for its address (FF A0).
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
