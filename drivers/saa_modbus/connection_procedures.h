#pragma once

#include "drivers/saa_modbus/procedures.h"

namespace axlecast::saa_modbus {

// Gives the encoder at `from` another address (A1); the reply comes from the new one. The encoder must answer
// before, and nobody, asked three times, at the new address: two encoders with one address could not be separated
// again on the bus. The request goes out once; then the place where the encoder answers decides.
class SetAddress final : public Procedure {
 public:
  SetAddress(std::uint8_t from, std::uint8_t to, Connection& connection);

  [[nodiscard]] Want Next(MonoNs now) const override;
  std::optional<Outcome> OnStarted(Bytes request, MonoNs now) override;
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return sent_; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kProbe, kSend, kSearch };

  std::optional<Outcome> OnBefore(const Answer& answer);
  std::optional<Outcome> OnProbed(const Answer& answer);
  std::optional<Outcome> OnSearched(const Answer& answer);
  [[nodiscard]] Outcome WithAddress(Outcome outcome, std::uint8_t after) const;

  const std::uint8_t from_;
  const std::uint8_t to_;
  Connection& connection_;
  Search search_;
  Stage stage_ = Stage::kReadBefore;
  bool sent_ = false;
  bool accepted_ = false;  // the reply came
  int failures_ = 0;
};

// Changes the encoder's baud rate (CC 24 to 57) and follows it. First the port is tried at the new rate, so that a
// port that cannot do it costs nothing. The request goes out once. At which rate its echo comes is not documented:
// it does not matter whether it is understood; the encoder is looked for at the new rate, then at the old one, and
// the place where it answers decides.
class SetBaud final : public Procedure {
 public:
  SetBaud(std::int64_t baud, Connection& connection);

  [[nodiscard]] Want Next(MonoNs now) const override;
  std::optional<Outcome> OnStarted(Bytes request, MonoNs now) override;
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override;
  void OnRetuned(MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return sent_; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kTryPort, kSend, kSearch };

  std::optional<Outcome> OnBefore(const Answer& answer);
  std::optional<Outcome> OnSearched(const Answer& answer);
  [[nodiscard]] Outcome WithBaud(Outcome outcome, std::int64_t after) const;

  const std::int64_t before_;
  const std::int64_t baud_;
  Connection& connection_;
  Search search_;
  Stage stage_ = Stage::kReadBefore;
  bool sent_ = false;
  bool accepted_ = false;  // the echo came, at the old rate
  int failures_ = 0;
};

}  // namespace axlecast::saa_modbus
