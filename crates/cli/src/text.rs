//! Messages in a line.

/// A message of several lines in one, without the advice at its end.
pub fn one_line(message: &str) -> String {
    let body = message.split("\n\nUsage:").next().unwrap_or(message);
    let body = body.split("\n\nFor more information").next().unwrap_or(body);
    // The parser's advice stands in a paragraph of its own.
    let body = body.replace("\n\n  tip:", "; tip:");
    let words: Vec<&str> = body.split_whitespace().collect();
    words.join(" ").trim_start_matches("error: ").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_advice_is_apart_from_the_mistake() {
        let message = "error: unexpected argument '--shart' found\n\n  tip: a similar argument exists: '--shard'\n\nUsage: x\n";
        assert_eq!(
            one_line(message),
            "unexpected argument '--shart' found; tip: a similar argument exists: '--shard'"
        );
    }

    #[test]
    fn regress_parser_messages_become_one_line() {
        let message = "error: invalid value 'x' for '--decay <DECAY>'\n  [possible values: slow, fast]\n\nFor more information, try '--help'.\n";
        assert_eq!(
            one_line(message),
            "invalid value 'x' for '--decay <DECAY>' [possible values: slow, fast]"
        );
    }
}
