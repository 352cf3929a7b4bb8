#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/cia406/interpreter.h"
#include "drivers/cia406/settings.h"
#include "drivers/kit/command_runner.h"
#include "drivers/protocol/canopen/sdo_client.h"

namespace axlecast::cia406 {

// One command being carried out, by SDO transfers one after the other.
class Procedure : public CommandProcedure {
 public:
  // Returns the transfer that it needs as soon as the bus allows.
  [[nodiscard]] virtual std::optional<SdoRequest> NextRequest(MonoNs now) const = 0;
  // Returns when OnTime must be called if nothing happens before.
  [[nodiscard]] virtual MonoNs Due(MonoNs now) const = 0;

  // The transfer is about to be sent.
  virtual void OnStarted([[maybe_unused]] const SdoRequest& request, [[maybe_unused]] MonoNs now) {}
  // It was not sent: the controller's queue is full.
  virtual void OnNotSent() {}
  // Any transfer of the node has ended, also one for another purpose.
  virtual std::optional<Outcome> OnResult(const SdoResult& result) = 0;
  // Time has passed.
  virtual std::optional<Outcome> OnTime(MonoNs now) = 0;
};

// Reads objects one after the other, and shows them.
class Readout final : public Procedure {
 public:
  // The values of the objects; nothing for an object that the encoder does not offer.
  using Values = std::vector<std::optional<std::uint32_t>>;
  using Show = std::function<Outcome(const Values& values, MonoNs now)>;

  Readout(std::vector<ObjectId> objects, MonoNs deadline, Show show)
      : objects_(std::move(objects)), deadline_(deadline), show_(std::move(show)) {}

  [[nodiscard]] std::optional<SdoRequest> NextRequest(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> OnResult(const SdoResult& result) override;
  std::optional<Outcome> OnTime(MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool reads_only() const override { return true; }

 private:
  const std::vector<ObjectId> objects_;
  const MonoNs deadline_;
  const Show show_;
  Values values_;
};

// Returns the readout of 6004h. With a `target`, it also shows whether a preset to it may have taken effect.
[[nodiscard]] std::unique_ptr<Procedure> ReadPosition(std::optional<std::uint32_t> target,
                                                      const Cia406Settings& settings, const DeviceOutput& output,
                                                      MonoNs deadline);
// Returns the readout of the device type and the identity: 1000h, 1018h.
[[nodiscard]] std::unique_ptr<Procedure> ReadIdentity(MonoNs deadline);
// Returns the readout of NMT state, error register, operating status, alarms, warnings and the last emergency message.
[[nodiscard]] std::unique_ptr<Procedure> ReadState(const Interpreter& interpreter, MonoNs deadline);

// Reads an object, then writes one once. The write is never repeated.
class WriteProcedure : public Procedure {
 public:
  void OnStarted(const SdoRequest& request, MonoNs now) override;
  void OnNotSent() override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return stage_ >= Stage::kSent; }

 protected:
  enum class Stage : std::uint8_t { kRead, kWrite, kSent, kVerify };

  // `write_timeout`: maximum time from the write to its confirmation.
  WriteProcedure(const Cia406Settings& settings, MonoNs now, MonoNs write_timeout);

  // Returns the outcome if it is unknown whether the write took effect.
  [[nodiscard]] virtual Outcome Unknown(std::string text) const;
  // Returns the text of that outcome after the link was lost.
  [[nodiscard]] virtual const char* LinkLostText() const = 0;

  const Cia406Settings& settings_;
  const MonoNs write_timeout_;
  Stage stage_ = Stage::kRead;
  MonoNs deadline_;
};

// Makes the encoder store its parameters (1010h sub 1, CiA 301 7.5.2.13). It first reads whether the encoder does so on
// command. The encoder confirms when it has stored them.
class SaveProcedure final : public WriteProcedure {
 public:
  SaveProcedure(const Cia406Settings& settings, MonoNs now);

  [[nodiscard]] std::optional<SdoRequest> NextRequest(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> OnResult(const SdoResult& result) override;
  std::optional<Outcome> OnTime(MonoNs now) override;

 private:
  [[nodiscard]] const char* LinkLostText() const override;
  [[nodiscard]] std::optional<Outcome> OnSaved(const SdoResult& result) const;
};

// Makes the present shaft angle read `target` (preset value 6003h): a reading that shows where the shaft was, a second
// check of the standstill, one write, and readings that show its effect.
class PresetProcedure final : public WriteProcedure {
 public:
  PresetProcedure(std::uint32_t target, const Cia406Settings& settings, const DeviceOutput& output, MonoNs now);

  [[nodiscard]] std::optional<SdoRequest> NextRequest(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs now) const override;
  std::optional<Outcome> OnResult(const SdoResult& result) override;
  std::optional<Outcome> OnTime(MonoNs now) override;

 private:
  [[nodiscard]] Outcome Unknown(std::string text) const override;
  [[nodiscard]] const char* LinkLostText() const override;
  [[nodiscard]] std::optional<Outcome> OnRead(const SdoResult& result);
  [[nodiscard]] std::optional<Outcome> OnWritten(const SdoResult& result);
  [[nodiscard]] std::optional<Outcome> Verify(std::uint32_t position);
  [[nodiscard]] bool SameBefore() const;
  [[nodiscard]] Outcome WithBefore(Outcome outcome, const std::string& after) const;

  const std::uint32_t target_;
  const DeviceOutput& output_;
  MonoNs effect_from_ = 0;
  std::uint32_t before_ = 0;
  bool confirmed_ = false;  // the encoder confirmed the write
  int readings_ = 0;        // after the write
};

}  // namespace axlecast::cia406
