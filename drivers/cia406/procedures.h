#pragma once

#include <optional>
#include <span>
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
  // The transfer that it wants as soon as the bus allows.
  [[nodiscard]] virtual std::optional<SdoRequest> Wants(MonoNs now) const = 0;
  // It wants to be asked again by then.
  [[nodiscard]] virtual MonoNs Due(MonoNs now) const = 0;

  // The transfer is about to go out; it did not, the controller's queue is full.
  virtual void OnStarted([[maybe_unused]] const SdoRequest& request, [[maybe_unused]] MonoNs now) {}
  virtual void OnNotSent() {}
  // Any transfer of the node has ended, also one that others wanted.
  virtual std::optional<Outcome> OnResult(const SdoResult& result) = 0;
  // Time has gone on.
  virtual std::optional<Outcome> OnTime(MonoNs now) = 0;
};

// Objects read one after the other, and shown. One that the encoder does not offer is left out.
class Readout : public Procedure {
 public:
  using Values = std::vector<std::optional<std::uint32_t>>;  // as `objects`

  Readout(std::span<const ObjectId> objects, MonoNs deadline)
      : objects_(objects.begin(), objects.end()), deadline_(deadline) {}

  [[nodiscard]] std::optional<SdoRequest> Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> OnResult(const SdoResult& result) override;
  std::optional<Outcome> OnTime(MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;

 protected:
  // All have been read.
  [[nodiscard]] virtual Outcome Show(const Values& values, MonoNs now) const = 0;

 private:
  const std::vector<ObjectId> objects_;
  const MonoNs deadline_;
  Values values_;
};

// 6004h; with a `target` also whether that is where a preset to it would have left the encoder.
class PositionReadout final : public Readout {
 public:
  PositionReadout(std::optional<std::uint32_t> target, const Cia406Settings& settings, const DeviceOutput& output,
                  MonoNs deadline);

 private:
  [[nodiscard]] Outcome Show(const Values& values, MonoNs now) const override;

  const std::optional<std::uint32_t> target_;
  const Cia406Settings& settings_;
  const DeviceOutput& output_;
};

// Device type, and who made it: 1000h, 1018h.
class IdentityReadout final : public Readout {
 public:
  explicit IdentityReadout(MonoNs deadline);

 private:
  [[nodiscard]] Outcome Show(const Values& values, MonoNs now) const override;
};

// How it is: NMT state, error register, operating status, alarms, warnings, the last emergency message.
class StateReadout final : public Readout {
 public:
  StateReadout(const Interpreter& interpreter, MonoNs deadline);

 private:
  [[nodiscard]] Outcome Show(const Values& values, MonoNs now) const override;

  const Interpreter& interpreter_;
};

// "turns 3, single-turn 4096 (180.0000 deg)"
[[nodiscard]] std::string PositionText(std::uint32_t position, const Cia406Settings& settings);
// Whether an encoder at rest that was set to `target` may read `position`.
[[nodiscard]] bool IsNear(std::uint32_t position, std::uint32_t target, const Cia406Settings& settings);

// Has the encoder store its parameters (1010h sub 1, CiA 301 7.5.2.13): asked first whether it does so on command,
// then told once. It confirms when it is done.
class SaveProcedure final : public Procedure {
 public:
  SaveProcedure(const Cia406Settings& settings, MonoNs now);

  [[nodiscard]] std::optional<SdoRequest> Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  void OnStarted(const SdoRequest& request, MonoNs now) override;
  void OnNotSent() override;
  std::optional<Outcome> OnResult(const SdoResult& result) override;
  std::optional<Outcome> OnTime(MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return stage_ == Stage::kSent; }

 private:
  enum class Stage : std::uint8_t { kAsk, kSend, kSent };

  [[nodiscard]] std::optional<Outcome> OnAsked(const SdoResult& result);
  [[nodiscard]] static Outcome OnSaved(const SdoResult& result);

  Stage stage_ = Stage::kAsk;
  MonoNs deadline_;
};

// Makes the present shaft angle read `target` (preset value 6003h): a reading that shows where the shaft was,
// standstill measured once more, one write, and readings that show its effect. The write goes out once and is never
// repeated.
class PresetProcedure final : public Procedure {
 public:
  PresetProcedure(std::uint32_t target, const Cia406Settings& settings, const DeviceOutput& output, MonoNs now);

  [[nodiscard]] std::optional<SdoRequest> Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs now) const override;
  void OnStarted(const SdoRequest& request, MonoNs now) override;
  void OnNotSent() override;
  std::optional<Outcome> OnResult(const SdoResult& result) override;
  std::optional<Outcome> OnTime(MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return stage_ >= Stage::kSent; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kWrite, kSent, kVerify };

  [[nodiscard]] std::optional<Outcome> OnRead(const SdoResult& result);
  [[nodiscard]] std::optional<Outcome> OnWritten(const SdoResult& result);
  [[nodiscard]] std::optional<Outcome> Verify(std::uint32_t position);
  [[nodiscard]] bool SameBefore() const;
  [[nodiscard]] Outcome WithBefore(Outcome outcome, const std::string& after) const;
  [[nodiscard]] bool AtRest(MonoNs now) const;

  const std::uint32_t target_;
  const Cia406Settings& settings_;
  const DeviceOutput& output_;
  Stage stage_ = Stage::kReadBefore;
  MonoNs deadline_;
  MonoNs effect_from_ = 0;
  std::uint32_t before_ = 0;
  bool confirmed_ = false;  // the encoder answered that it took the write
  int readings_ = 0;        // after the write
};

}  // namespace axlecast::cia406
