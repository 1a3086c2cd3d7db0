//! Tree of lists, words and comments, with the line breaks before each.

/// Node of a text: word, comment or list.
#[derive(Debug, Clone)]
pub struct LayoutNode<'a> {
    /// Number of line breaks before the node.
    pub breaks: usize,
    /// Number of blanks between the node and the one before on the same line.
    pub blanks: usize,
    /// Content of the node.
    pub what: What<'a>,
}

/// Content of a [`LayoutNode`].
#[derive(Debug, Clone)]
pub enum What<'a> {
    /// Word: text between delimiters.
    Word(&'a str),
    /// Comment: text from the semicolon to the end of the line, and its column.
    Comment(&'a str, usize),
    /// List: opening bracket, children and closing bracket.
    List(char, Vec<LayoutNode<'a>>, char),
}

impl<'a> LayoutNode<'a> {
    /// Word of the node; `None` for lists and comments.
    pub fn word(&self) -> Option<&'a str> {
        match self.what {
            What::Word(word) => Some(word),
            _ => None,
        }
    }

    /// True for comments.
    pub fn is_comment(&self) -> bool {
        matches!(self.what, What::Comment(..))
    }

    /// True for lists.
    pub fn is_list(&self) -> bool {
        matches!(self.what, What::List(..))
    }
}

/// Parses a text with balanced parentheses.
pub fn read(text: &str) -> Vec<LayoutNode<'_>> {
    // The outermost list is the text itself.
    let mut open: Vec<(Gap, char, Vec<LayoutNode<'_>>)> = vec![(Gap::default(), '(', Vec::new())];
    let (mut at, mut gap, mut line_start) =
        (if text.starts_with('\u{feff}') { 3 } else { 0 }, Gap::default(), 0);
    let bytes = text.as_bytes();
    while let Some(&byte) = bytes.get(at) {
        let end = match byte {
            b'\n' => {
                gap = Gap { breaks: gap.breaks + 1, blanks: 0 };
                line_start = at + 1;
                at + 1
            }
            b' ' | b'\t' | b'\r' | 0x0b | 0x0c => {
                gap.blanks += 1;
                at + 1
            }
            b'(' | b'[' => {
                open.push((std::mem::take(&mut gap), char::from(byte), Vec::new()));
                at + 1
            }
            b')' | b']' => {
                gap = Gap::default();
                if let Some((gap, sign, children)) = open.pop() {
                    put(&mut open, gap, What::List(sign, children, char::from(byte)));
                }
                at + 1
            }
            b';' => {
                let end = text[at..].find('\n').map_or(text.len(), |n| at + n);
                let column = text[line_start..at].chars().count();
                let what = What::Comment(text[at..end].trim_end(), column);
                put(&mut open, std::mem::take(&mut gap), what);
                end
            }
            _ => {
                let delimiter = |byte: &u8| byte.is_ascii_whitespace() || b"\x0b()[];?".contains(byte);
                let rest = &bytes[at + 1..];
                let end = at + 1 + rest.iter().position(delimiter).unwrap_or(rest.len());
                let what = What::Word(&text[at..end]);
                put(&mut open, std::mem::take(&mut gap), what);
                end
            }
        };
        at = end;
    }
    open.into_iter().next().map(|(_, _, children)| children).unwrap_or_default()
}

fn put<'a>(open: &mut [(Gap, char, Vec<LayoutNode<'a>>)], Gap { breaks, blanks }: Gap, what: What<'a>) {
    if let Some((_, _, children)) = open.last_mut() {
        children.push(LayoutNode { breaks, blanks, what });
    }
}

/// Line breaks and blanks between two nodes.
#[derive(Debug, Clone, Copy, Default)]
struct Gap {
    breaks: usize,
    blanks: usize,
}
