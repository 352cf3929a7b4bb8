#include "bridge/store/axis_row.h"

#include "core/command/command_id.h"
#include "core/messages/enum_names.h"

namespace axlecast {

DatumRecord DatumOf(const Rows& row, int first_column) {
  DatumRecord datum;
  datum.number = row.Integer(first_column);
  datum.counts = row.Integer(first_column + 1);
  datum.utime = row.Integer(first_column + 2);
  datum.identity = row.Text(first_column + 3);
  datum.value = row.Text(first_column + 4);
  datum.who = row.Text(first_column + 5);
  datum.command = ParseId(row.Text(first_column + 6)).value_or(CommandId{});
  datum.reason = row.Text(first_column + 7);
  if (row.IsNull(first_column + 8)) return datum;
  datum.voided_utime = row.Integer(first_column + 8);
  datum.void_reason = row.Text(first_column + 9);
  return datum;
}

AxisRecord AxisOf(const Rows& row, int first_column) {
  AxisRecord axis;
  axis.identity = row.Text(first_column);
  axis.reference_lost = row.Integer(first_column + 1) != 0;
  axis.writes = row.Integer(first_column + 2);
  axis.since_utime = row.Integer(first_column + 3);
  if (!row.IsNull(first_column + 4)) {
    axis.position = LastPosition{row.Integer(first_column + 4), row.Integer(first_column + 5)};
  }
  if (!row.IsNull(first_column + 6)) axis.datum = DatumOf(row, first_column + 6);
  return axis;
}

}  // namespace axlecast
