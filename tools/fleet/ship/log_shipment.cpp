#include "tools/fleet/ship/log_shipment.h"

#include <algorithm>
#include <utility>

#include "tools/log/log_merge.h"
#include "tools/log/log_reader.h"

namespace axlecast {
namespace {

// Calls `visit` for each record of verified records.
template <typename Visit>
void ForEachEvent(Bytes records, Visit visit) {
  while (const std::optional<LogEvent> event = ParseEvent(records)) {
    visit(*event);
    records = records.subspan(EventSize(*event));
  }
}

// Time of the reception of the record at `offset`; 0 without one.
std::int64_t UtimeAt(Bytes log, std::size_t offset) {
  if (offset >= log.size()) return 0;
  const std::optional<LogEvent> event = ParseEvent(log.subspan(offset));
  return event ? event->utime : 0;
}

}  // namespace

Result<std::unique_ptr<LogShipment>> LogShipment::Open(const std::string& folder, const FolderLog& log,
                                                       const LedgerEntry& entry, const DetailRules& detail,
                                                       const UtimeRange& range,
                                                       const std::optional<FolderLog>& previous) {
  std::unique_ptr<LogShipment> shipment(new LogShipment(folder, log, entry));
  if (const Result<> read = shipment->Refresh(log); !read) return Failure(read.error());
  shipment->place_ = FindPlace(shipment->content_->bytes(), entry.upto,
                               static_cast<std::size_t>(std::max<std::int64_t>(0, entry.bytes)));
  shipment->composer_ = std::make_unique<RowComposer>(*log.facts, log.key.name, detail, range);
  shipment->Prime(previous);
  return shipment;
}

Result<> LogShipment::Refresh(const FolderLog& log) {
  log_ = log;
  if (content_ != nullptr && (log.compressed || static_cast<std::int64_t>(content_->bytes().size()) >= log.bytes))
    return {};
  auto content = std::make_unique<OpenedLog>(folder_ + '/' + log.file);
  if (!content->problem().empty()) return Failure(content->problem());
  content_ = std::move(content);
  return {};
}

void LogShipment::Prime(const std::optional<FolderLog>& previous) {
  const Bytes before = content_->bytes().first(place_.offset);
  // The record of a seal is in front of the place. Without one, the time is that of the last message.
  const std::int64_t utime =
      before.size() >= kSealRecord ? UtimeAt(before, before.size() - kSealRecord) : log_.key.start_utime;
  const std::int64_t from = (utime != 0 ? utime : entry_.last_utime) - RowComposer::kPrimeUs;
  if (previous && from < log_.key.start_utime) {
    const OpenedLog content(folder_ + '/' + previous->file);
    if (content.problem().empty()) {
      // Its end: it may have ended long before, for example because the recorder was killed.
      PrimeWith(content.bytes(), SpanOf({content.bytes()}).last - RowComposer::kPrimeUs);
    }
  }
  PrimeWith(before, from);
}

void LogShipment::PrimeWith(Bytes log, std::int64_t from) {
  LogReader reader(log, SeekTime(log, from));
  for (auto event = reader.Next(); event; event = reader.Next()) composer_->Prime(*event);
}

void LogShipment::Add(const LogStretch& stretch, LedgerEntry& after) {
  ForEachEvent(stretch.records, [this](const LogEvent& event) {
    composer_->Add(event);
    if (!IsLogChannel(event.channel)) last_received_ = event.utime;
  });
  composer_->EndStretch();
  if (stretch.kind == LogStretch::Kind::kSealed) after.chain = Crc32c(after.chain, EncodeSeal(stretch.seal));
}

std::optional<HoleRow> LogShipment::HoleOf(const LogStretch& stretch, const LogPlace& place) const {
  if (stretch.messages == 0) return std::nullopt;
  HoleRow hole;
  if (stretch.messages < 0) {
    hole.cause = "the end of the log is damaged or torn";
  } else {
    hole.cause = stretch.bytes == 0 ? "a repair of the log has removed damaged records" : "the log is damaged";
  }
  hole.t0 = last_received_ != 0 ? last_received_ : log_.key.start_utime;
  hole.t1 = UtimeAt(content_->bytes(), stretch.next.offset);
  hole.first_event = place.number;
  hole.messages = stretch.messages;
  hole.bytes = static_cast<std::int64_t>(stretch.bytes);
  return hole;
}

ShipBatch LogShipment::Begin() const {
  ShipBatch batch;
  batch.key = log_.key;
  batch.file = log_.file;
  batch.before = entry_;
  batch.after = entry_;
  return batch;
}

ComposedBatch LogShipment::Finish(ShipBatch batch, const LogPlace& place, bool more) {
  batch.after.upto = place.number;
  batch.after.bytes = static_cast<std::int64_t>(place.offset);
  batch.after.closed = log_.closed && place.offset >= content_->bytes().size();
  batch.rows = composer_->Take();
  batch.after.last_utime = std::max(batch.before.last_utime, batch.rows.last_utime);
  entry_ = batch.after;
  place_ = place;
  return {.batch = std::move(batch), .more = more, .last_received = last_received_};
}

ComposedBatch LogShipment::Next(const UtimeRange& range, const BatchLimit& limit) {
  ShipBatch batch = Begin();
  composer_->SetRange(range);
  LogPlace place = place_;
  bool more = false;
  while (!more) {
    const LogStretch stretch = NextStretch(content_->bytes(), place, log_.closed);
    if (stretch.kind == LogStretch::Kind::kIncomplete) break;
    if (stretch.kind != LogStretch::Kind::kDamaged) {
      Add(stretch, batch.after);
    } else if (std::optional<HoleRow> hole = HoleOf(stretch, place)) {
      batch.holes.push_back(*std::move(hole));
    }
    place = stretch.next;
    more = limit.one_stretch || place.offset - place_.offset >= limit.bytes;
  }
  return Finish(std::move(batch), place, more);
}

ComposedBatch LogShipment::NextAsHole(const std::string& cause) {
  ShipBatch batch = Begin();
  const LogStretch stretch = NextStretch(content_->bytes(), place_, log_.closed);
  if (stretch.kind == LogStretch::Kind::kIncomplete) return Finish(std::move(batch), place_, false);
  HoleRow hole{.cause = cause, .first_event = place_.number, .messages = 0};
  ForEachEvent(stretch.records, [&hole](const LogEvent& event) {
    if (hole.t0 == 0) hole.t0 = event.utime;
    hole.t1 = event.utime;
    ++hole.messages;
  });
  if (stretch.kind == LogStretch::Kind::kDamaged) hole.messages = stretch.messages;
  if (stretch.kind == LogStretch::Kind::kSealed)
    batch.after.chain = Crc32c(batch.after.chain, EncodeSeal(stretch.seal));
  hole.bytes = static_cast<std::int64_t>(stretch.next.offset - place_.offset);
  batch.holes.push_back(std::move(hole));
  return Finish(std::move(batch), stretch.next, true);
}

}  // namespace axlecast
