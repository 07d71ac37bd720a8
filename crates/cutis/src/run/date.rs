//! The date of a run.

use std::time::{SystemTime, UNIX_EPOCH};

/// The present time in UTC as RFC 3339 has it: `2026-11-27T01:12:03Z`.
pub(super) fn utc_now() -> String {
    utc(SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs())
}

/// The time in UTC of `seconds` after the beginning of 1970.
fn utc(seconds: u64) -> String {
    let [year, month, day] = date(seconds / 86_400);
    let [hour, minute, second] = [seconds / 3600 % 24, seconds / 60 % 60, seconds % 60];
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// Year, month and day that begin `days` after the beginning of 1970 in the Gregorian calendar.
///
/// A year that begins in March has its leap day at the end, and its months have 153 days in each
/// five. The calendar repeats after 400 years (Howard Hinnant, *chrono-Compatible Low-Level Date
/// Algorithms*, `civil_from_days`).
fn date(days: u64) -> [u64; 3] {
    // Days from 0000-03-01 to 1970-01-01.
    let days = days + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 };
    [400 * era + year_of_era + u64::from(month <= 2), month, day]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times of `date -u -d @SECONDS +%FT%TZ`.
    #[test]
    fn times_are_those_of_the_program_date() {
        for (seconds, expected) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (951_868_800, "2000-03-01T00:00:00Z"),
            (1_795_741_923, "2026-11-27T01:12:03Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(utc(seconds), expected);
        }
    }

    /// Each day is the next one of the day before, by the lengths of the months.
    #[test]
    fn no_day_of_two_centuries_is_left_out() {
        let mut expected = [1970, 1, 1];
        for days in 0..73_000 {
            assert_eq!(date(days), expected);
            let [year, month, day] = expected;
            let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
            let length = match month {
                2 => 28 + u64::from(leap),
                4 | 6 | 9 | 11 => 30,
                _ => 31,
            };
            expected = match (month, day) {
                (12, 31) => [year + 1, 1, 1],
                _ if day == length => [year, month + 1, 1],
                _ => [year, month, day + 1],
            };
        }
    }
}
