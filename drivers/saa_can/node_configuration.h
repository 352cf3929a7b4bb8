#pragma once

#include <array>
#include <optional>
#include <string>

#include "drivers/saa_can/procedures.h"
#include "drivers/saa_can/settings.h"

namespace axlecast::saa_can {

// Finds out at which of two node ids an encoder answers 80 NN. The bus must be a bench.
class NodeSearch {
 public:
  enum class Progress : std::uint8_t { kRunning, kFirst, kSecond, kNowhere };

  NodeSearch(std::uint8_t first, std::uint8_t second, const SaaCanSettings& settings);

  [[nodiscard]] Procedure::Need NextNeed() const;
  [[nodiscard]] MonoNs due() const { return due_; }
  void OnStarted(const CanFrame& frame) { delivery_.Start(frame); }
  [[nodiscard]] Progress On(const Event& event, MonoNs now);

 private:
  [[nodiscard]] std::uint8_t node() const { return nodes_.at(tried_); }

  const std::array<std::uint8_t, 2> nodes_;
  const MonoNs timeout_;
  std::size_t tried_ = 0;
  Delivery delivery_;
  MonoNs due_ = kNever;  // the answer to the request must come by then
};

// Gives the encoder another node id or bit rate through the dialogue on 7E5 (SAA manual 5.4.1 (3) ②③), which every node
// on the bus obeys. Therefore it first listens, and continues only if no other node is received. It checks this again
// before each frame. Each frame is sent once.
//
// After a new node id, the encoder leaves configuration mode (CiA 305; the manual does not describe this), and the id at
// which it answers decides. After a new bit rate nothing more is sent: the interface still has the old rate.
class NodeConfigurationProcedure final : public Procedure {
 public:
  struct Target {
    Service service = Service::kNode;
    std::uint8_t node = 0;     // kNode
    std::int64_t bitrate = 0;  // kBitrate
  };
  NodeConfigurationProcedure(const Target& target, const OperationContext& context, MonoNs now);

  [[nodiscard]] Need NextNeed(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs now) const override;
  void OnStarted(const CanFrame& frame) override;
  std::optional<Outcome> On(const Event& event, const Interpreter::Evaluation& evaluation, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return stage_ > Stage::kEnter || IsOnItsWay(); }
  [[nodiscard]] bool alone() const override { return stage_ > Stage::kListen; }
  [[nodiscard]] bool silences() const override { return set_ && target_.service == Service::kBitrate && !refused_; }

  // Three periods of the slowest encoder, one position a second.
  static constexpr MonoNs kListen = 3'500 * kMillisecond;

 private:
  enum class Stage : std::uint8_t { kListen, kEnter, kSet, kReply, kLeave, kSearch };

  [[nodiscard]] bool IsOnItsWay() const { return delivery_.state() != Delivery::State::kIdle; }
  [[nodiscard]] bool IsOnBus() const { return delivery_.state() == Delivery::State::kOnBus; }
  void Watch(const Event& event);
  std::optional<Outcome> OnListened(MonoNs now);
  std::optional<Outcome> OnEntered(MonoNs now);
  std::optional<Outcome> OnSet();
  std::optional<Outcome> OnReply(const Event& event, MonoNs now);
  std::optional<Outcome> OnLeft();
  std::optional<Outcome> OnSearched(const Event& event, MonoNs now);
  // Keeps the final outcome until the encoder has left configuration mode.
  void End(Outcome outcome);
  void Enter(Stage stage);
  [[nodiscard]] Outcome OtherNodeFound() const;
  [[nodiscard]] Outcome BitrateOutcome() const;
  [[nodiscard]] Outcome WithChange(Outcome outcome) const;

  const Target target_;
  const OperationContext context_;
  Stage stage_ = Stage::kListen;
  Delivery delivery_;  // of the stage's frame
  MonoNs until_;       // end of the stages kListen and kReply
  bool encoder_found_ = false;
  std::optional<std::uint32_t> other_;  // identifier of another node's frame
  bool set_ = false;                    // the frame that changes something is in the queue, or was on the bus
  bool refused_ = false;                // by the encoder
  int replies_ = 0;
  std::optional<Outcome> ending_;
  NodeSearch search_;
};

// Finds out at which node id the encoder answers, to see whether set_node_id took effect.
class ReadNode final : public ReadProcedure {
 public:
  ReadNode(std::uint8_t node, const OperationContext& context)
      : node_(node), context_(context), search_(node, context.settings.node, context.settings) {}

  [[nodiscard]] Need NextNeed(MonoNs) const override { return search_.NextNeed(); }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return search_.due(); }
  void OnStarted(const CanFrame& frame) override { search_.OnStarted(frame); }
  std::optional<Outcome> On(const Event& event, const Interpreter::Evaluation& evaluation, MonoNs now) override;
  [[nodiscard]] bool alone() const override { return true; }

 private:
  const std::uint8_t node_;
  const OperationContext context_;
  NodeSearch search_;
};

}  // namespace axlecast::saa_can
