#include <array>
#include <utility>

#include "drivers/kit/command_runner.h"
#include "drivers/saa_modbus/operations.h"

namespace axlecast::saa_modbus {
namespace {

using Reason = command_status_t;

// Requests the position at two places, one after the other, and finds the one where the encoder answers.
class Search {
 public:
  enum class Progress : std::uint8_t { kGoing, kFirst, kSecond, kNowhere };

  // The time until the encoder receives at its new place is not documented.
  static constexpr MonoNs kSettle = 50 * kMillisecond;

  Search(Place first, Place second, const Connection& connection)
      : places_{first, second}, connection_(connection) {}

  // Sends nothing before `from`.
  void Start(MonoNs from) { due_ = from; }
  void OnBaudRateSet(MonoNs now) { due_ = now + kSettle; }

  [[nodiscard]] ProcedureStep Next(MonoNs now) const {
    const Place& place = places_.at(tried_);
    if (connection_.port_baud != place.baud) return SetBaudRate{place.baud};
    if (now < due_) return Idle{due_};
    return ReadAt{place.address};
  }

  [[nodiscard]] Progress OnAnswer(const Answer& answer) {
    if (answer.ok()) return tried_ == 0 ? Progress::kFirst : Progress::kSecond;
    if (++failures_ < kTries) return Progress::kGoing;
    failures_ = 0;
    if (tried_ + 1 == places_.size()) return Progress::kNowhere;
    ++tried_;
    return Progress::kGoing;
  }

 private:
  std::array<Place, 2> places_;
  const Connection& connection_;
  std::size_t tried_ = 0;
  int failures_ = 0;
  MonoNs due_ = 0;
};

void Follow(const Place& place, Connection& connection) {
  connection.address = place.address;
  connection.baud = place.baud;
}

// Writes an address (A1) or a baud rate (CC 24 to 57).
// - The encoder must answer at its present place first.
// - A new address: nothing may answer there, requested three times. On a bus, two encoders with one address cannot be
//   separated again. The reply comes from the new address.
// - A new baud rate: the port is set to it first, so that a port without that rate costs nothing. The rate of the
//   encoder's echo is not documented, so the echo need not be understood.
// The request is sent once. Then the place where the encoder answers decides.
class ConnectionChange final : public Procedure {
 public:
  ConnectionChange(ConnectionKey key, Place from, Place to, Connection& connection)
      : key_(key), from_(from), to_(to), connection_(connection), search_(to, from, connection) {}

  [[nodiscard]] ProcedureStep Next(MonoNs now) const override {
    switch (stage_) {
      case Stage::kReadBefore:
        return ReadAt{from_.address};
      case Stage::kTry:
        if (key_ == ConnectionKey::kBaud) return SetBaudRate{to_.baud};
        return ReadAt{to_.address};
      case Stage::kSend:
        if (connection_.port_baud != from_.baud) return SetBaudRate{from_.baud};
        if (key_ == ConnectionKey::kBaud) return SetParameterRequest(from_.address, *BaudParameter(to_.baud));
        return SetAddressRequest(from_.address, to_.address);
      default:
        return search_.Next(now);
    }
  }

  std::optional<Outcome> OnStarted(Bytes, MonoNs) override {
    sent_ = sent_ || stage_ == Stage::kSend;
    return std::nullopt;
  }

  void OnBaudRateSet(MonoNs now) override {
    if (stage_ == Stage::kTry) stage_ = Stage::kSend;
    if (stage_ == Stage::kSearch) search_.OnBaudRateSet(now);
  }

  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override {
    switch (stage_) {
      case Stage::kReadBefore:
        return OnBefore(answer);
      case Stage::kTry:
        return OnProbed(answer);
      case Stage::kSend:
        accepted_ = answer.ok();
        stage_ = Stage::kSearch;
        search_.Start(end + Search::kSettle);
        return std::nullopt;
      default:
        return OnSearched(answer);
    }
  }

  [[nodiscard]] Outcome OnLinkLost() const override {
    if (sent_) {
      return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                   "the link was lost after the request: " + Look() + " when it is back");
    }
    const bool port = stage_ == Stage::kTry && key_ == ConnectionKey::kBaud;
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
                 port ? "nothing was done: the port cannot do " + Shown(to_) + ", or the link was lost"
                      : "nothing was done: the link was lost");
  }

  [[nodiscard]] bool touched() const override { return sent_; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kTry, kSend, kSearch };

  std::optional<Outcome> OnBefore(const Answer& answer) {
    if (!answer.ok()) {
      if (++failures_ < kTries) return std::nullopt;
      return Rejected(Reason::REASON_NO_REPLY,
                      "no encoder answers at " + Shown(from_) + " (" + ErrorName(*answer.error) + ")");
    }
    if (from_ == to_) {
      Follow(to_, connection_);
      return WithChange(Verified("the encoder answers at " + Shown(to_) + " already: nothing was written"), to_);
    }
    stage_ = Stage::kTry;
    failures_ = 0;
    if (key_ == ConnectionKey::kAddress) return std::nullopt;
    return Outcome{.text = "the encoder answers at " + Shown(from_), .progress = 0.2F};
  }

  // A timeout is the good answer, several times, because a reply may be lost. Any byte shows that the address is taken.
  std::optional<Outcome> OnProbed(const Answer& answer) {
    if (answer.error != ErrorKind::kTimeout) {
      return Rejected(
          Reason::REASON_NOT_PERMITTED,
          "something answers at " + Shown(to_) + ": choose another, or give that device another address first");
    }
    if (++failures_ < kTries) return std::nullopt;
    stage_ = Stage::kSend;
    return Outcome{.text = "the encoder answers at " + Shown(from_) + ", nothing at " + Shown(to_),
                   .progress = 0.3F};
  }

  std::optional<Outcome> OnSearched(const Answer& answer) {
    const std::string reply = accepted_ ? "it accepted the change" : "no reply to the change was understood";
    switch (search_.OnAnswer(answer)) {
      case Search::Progress::kGoing:
        return std::nullopt;
      case Search::Progress::kFirst:
        Follow(to_, connection_);
        return WithChange(
            Verified("the encoder answers at " + Shown(to_) +
                     " and the driver follows until it is restarted: put " +
                     (key_ == ConnectionKey::kBaud ? "link." : "") + Key() + ": " + Value(to_) + " into the file"),
            to_);
      case Search::Progress::kSecond:
        return WithChange(Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                                reply + ", but the encoder still answers at " + Shown(from_)),
                          from_);
      default:
        return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                     reply + ", and the encoder answers neither at " + Shown(to_) + " nor at " + Shown(from_) +
                         ": turn its power off and on, then " + Look());
    }
  }

  [[nodiscard]] std::string Key() const { return key_ == ConnectionKey::kBaud ? "baud" : "address"; }
  [[nodiscard]] std::string Value(const Place& place) const {
    return std::to_string(key_ == ConnectionKey::kBaud ? place.baud : place.address);
  }
  // "address 2" or "9600 Bd"
  [[nodiscard]] std::string Shown(const Place& place) const {
    return key_ == ConnectionKey::kBaud ? Value(place) + " Bd" : "address " + Value(place);
  }
  // The command that verifies this one.
  [[nodiscard]] std::string Look() const {
    return "read_position after=\"set_" + Key() + ' ' + Key() + '=' + Value(to_) + '"';
  }
  [[nodiscard]] Outcome WithChange(Outcome outcome, const Place& after) const {
    outcome.changes.push_back({Key(), Value(from_), Value(after)});
    return outcome;
  }

  const ConnectionKey key_;
  const Place from_;
  const Place to_;
  Connection& connection_;
  Search search_;
  Stage stage_ = Stage::kReadBefore;
  bool sent_ = false;
  bool accepted_ = false;  // the reply came, in time and at the present rate
  int failures_ = 0;
};

class FindEncoder final : public Procedure {
 public:
  FindEncoder(Place changed, std::string after, const OperationContext& context)
      : changed_(changed),
        after_(std::move(after)),
        bits_(context.settings.bits),
        connection_(context.connection),
        search_(changed, {connection_.address, connection_.baud}, connection_) {}

  [[nodiscard]] ProcedureStep Next(MonoNs now) const override { return search_.Next(now); }
  void OnBaudRateSet(MonoNs now) override { search_.OnBaudRateSet(now); }

  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs) override {
    const Search::Progress progress = search_.OnAnswer(answer);
    if (progress == Search::Progress::kGoing) return std::nullopt;
    if (progress == Search::Progress::kNowhere) {
      return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
                   "the encoder answers neither at its old place nor at the one after " + after_);
    }
    const bool changed = progress == Search::Progress::kFirst;
    if (changed) Follow(changed_, connection_);
    Outcome outcome = PositionOutcome(Text("the encoder answers at address %d, %lld Bd: ", int{connection_.address},
                                           static_cast<long long>(connection_.baud)),
                                      answer.reply.counts, bits_);
    outcome.changes.push_back({"address", "", std::to_string(connection_.address)});
    outcome.changes.push_back({"baud", "", std::to_string(connection_.baud)});
    outcome.changes.push_back(FindingChange(FindingWord(changed)));
    return outcome;
  }

 private:
  const Place changed_;
  const std::string after_;
  const int bits_;
  Connection& connection_;
  Search search_;
};

class QueryAddress final : public Procedure {
 public:
  explicit QueryAddress(const Connection& connection) : connection_(connection) {}

  [[nodiscard]] ProcedureStep Next(MonoNs) const override { return QueryRequest(); }

  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs) override {
    if (!answer.ok()) return CountFailure(answer, failures_);
    const int address = answer.reply.address;
    const int asked = connection_.address;
    std::string text = Text("the encoder has address %d", address);
    if (address != asked) {
      text +=
          Text(", but is asked at %d: change the file, or set_address address=%d from=%d", asked, asked, address);
    }
    Outcome outcome = Verified(std::move(text));
    outcome.changes.push_back({"address", "", std::to_string(address)});
    return outcome;
  }

 private:
  const Connection& connection_;
  int failures_ = 0;
};

}  // namespace

std::unique_ptr<Procedure> MakeConnectionChange(ConnectionKey key, Place from, Place to, Connection& connection) {
  return std::make_unique<ConnectionChange>(key, from, to, connection);
}

std::unique_ptr<Procedure> MakeFindEncoder(Place changed, std::string after, const OperationContext& context) {
  return std::make_unique<FindEncoder>(changed, std::move(after), context);
}

std::unique_ptr<Procedure> MakeQueryAddress(const Connection& connection) {
  return std::make_unique<QueryAddress>(connection);
}

}  // namespace axlecast::saa_modbus
