#pragma once

#include <array>
#include <optional>
#include <string>

#include "drivers/saa_can/procedures.h"
#include "drivers/saa_can/settings.h"

namespace axlecast::saa_can {

// Looks at which of two node ids an encoder answers 80 NN: first the first, then the second. The bus must be a bench's.
class NodeSearch {
 public:
  enum class Progress : std::uint8_t { kGoing, kFirst, kSecond, kNowhere };

  NodeSearch(std::uint8_t first, std::uint8_t second, const SaaCanSettings& settings);

  [[nodiscard]] std::optional<CanFrame> Wants() const;
  [[nodiscard]] MonoNs due() const { return due_; }
  void OnStarted(const CanFrame& frame) { delivery_.Start(frame); }
  [[nodiscard]] Progress On(const Event& event, MonoNs now);
  // Of the encoder, when it was found.
  [[nodiscard]] const Position& position() const { return position_; }

 private:
  [[nodiscard]] std::uint8_t node() const { return nodes_.at(tried_); }

  const std::array<std::uint8_t, 2> nodes_;
  const Format format_;
  const MonoNs patience_;
  std::size_t tried_ = 0;
  Delivery delivery_;
  MonoNs due_ = kNever;  // the request is out, and the answer must have come by then
  Position position_;
};

// Gives the encoder another node id or bit rate through the dialogue on 7E5 (SAA manual 5.4.1 (3) ②③), which every
// node on the bus takes: so it listens first, and begins only when nobody but this encoder is heard. It looks again
// before each frame. Each goes out once.
//
// After a new node id the encoder is taken out of configuration mode (CiA 305; the manual does not say how), and the
// id at which it answers decides. After a new bit rate nothing more is sent: the interface still has the old one.
class NodeConfigurationProcedure final : public Procedure {
 public:
  struct Target {
    Service service = Service::kNode;
    std::uint8_t node = 0;     // kNode
    std::int64_t bitrate = 0;  // kBitrate
    std::int64_t before = 0;   // bit rate at which the encoder is heard
  };
  NodeConfigurationProcedure(const Target& target, const OperationContext& context, MonoNs now);

  [[nodiscard]] Want Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs now) const override;
  void OnStarted(const CanFrame& frame) override;
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return stage_ > Stage::kEnter || IsOnItsWay(); }
  [[nodiscard]] bool alone() const override { return stage_ > Stage::kListen; }
  [[nodiscard]] bool silences() const override { return set_ && target_.service == Service::kBitrate && !refused_; }

  // Three periods of the slowest encoder, of one position a second.
  static constexpr MonoNs kListen = 3'500 * kMillisecond;
  // The command that enters configuration mode is not answered.
  static constexpr MonoNs kEntering = 50 * kMillisecond;
  // After the first reply: another one shows that a node was there that had kept silent.
  static constexpr MonoNs kMoreReplies = 200 * kMillisecond;

 private:
  enum class Stage : std::uint8_t { kListen, kEnter, kSet, kReply, kLeave, kLook };

  [[nodiscard]] bool IsOnItsWay() const { return delivery_.state() != Delivery::State::kIdle; }
  [[nodiscard]] CanFrame SetFrame() const;
  void Watch(const Event& event);
  std::optional<Outcome> OnListened(MonoNs now);
  std::optional<Outcome> OnEntered(MonoNs now);
  std::optional<Outcome> OnSet();
  std::optional<Outcome> OnReply(const Event& event, MonoNs now);
  std::optional<Outcome> OnLeft();
  std::optional<Outcome> OnLooked(const Event& event, MonoNs now);
  // The final outcome, which waits until the encoder was told to leave configuration mode.
  void End(Outcome outcome);
  void Go(Stage stage);
  [[nodiscard]] Outcome Crowded() const;
  [[nodiscard]] Outcome JudgeBitrate() const;
  [[nodiscard]] Outcome WithChange(Outcome outcome) const;

  const Target target_;
  const OperationContext context_;
  Stage stage_ = Stage::kListen;
  Delivery delivery_;                   // of the stage's frame
  MonoNs until_;                        // of the stage, where it has an end of its own
  bool heard_ = false;                  // the encoder
  std::optional<std::uint32_t> other_;  // identifier of somebody else's frame
  bool set_ = false;                    // the frame that changes something is in the queue, or was on the bus
  bool refused_ = false;                // the encoder said so
  int replies_ = 0;
  std::optional<Outcome> ending_;
  NodeSearch search_;
};

// Looks at which node id the encoder answers, to see whether set_node_id took effect.
class LookForNode final : public Procedure {
 public:
  LookForNode(std::uint8_t node, const OperationContext& context);

  [[nodiscard]] Want Wants(MonoNs) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override { return search_.due(); }
  void OnStarted(const CanFrame& frame) override { search_.OnStarted(frame); }
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool alone() const override { return true; }

 private:
  const std::uint8_t node_;
  const OperationContext context_;
  NodeSearch search_;
};

}  // namespace axlecast::saa_can
