//! The attribute `#[gaurast_runner::test]`.

use proc_macro::TokenStream;
use quote::quote;
use syn::punctuated::Punctuated;
use syn::{Expr, ItemFn, Meta, ReturnType, Token, parse_macro_input};

/// Registers a function as a test of the executable that contains it.
///
/// The function takes nothing or a `&Case`, and returns nothing. Arguments, in any order:
///
/// - `needs = EXPRESSION`: an array of `Need`s. The test is ignored if one of them is missing.
/// - `each = EXPRESSION`: a `Vec<Variant>`. The test runs once for each variant, which `Case::variant` names.
/// - `alone`: the test runs in a process of its own.
#[proc_macro_attribute]
pub fn test(arguments: TokenStream, item: TokenStream) -> TokenStream {
    let arguments = parse_macro_input!(arguments with Punctuated::<Meta, Token![,]>::parse_terminated);
    let function = parse_macro_input!(item as ItemFn);
    match registration(&arguments, &function) {
        Ok(registration) => quote! { #function #registration }.into(),
        Err(error) => error.into_compile_error().into(),
    }
}

/// Makes the item that registers `function`.
fn registration(arguments: &Punctuated<Meta, Token![,]>, function: &ItemFn) -> syn::Result<proc_macro2::TokenStream> {
    let mut needs: Option<&Expr> = None;
    let mut each: Option<&Expr> = None;
    let mut alone = false;
    for argument in arguments {
        match argument {
            Meta::NameValue(pair) if pair.path.is_ident("needs") => needs = Some(&pair.value),
            Meta::NameValue(pair) if pair.path.is_ident("each") => each = Some(&pair.value),
            Meta::Path(path) if path.is_ident("alone") => alone = true,
            other => {
                let message = "expected `needs = ...`, `each = ...` or `alone`";
                return Err(syn::Error::new_spanned(other, message));
            }
        }
    }
    if let ReturnType::Type(_, returned) = &function.sig.output {
        return Err(syn::Error::new_spanned(returned, "a test returns nothing"));
    }
    let name = &function.sig.ident;
    let run = if function.sig.inputs.is_empty() {
        quote! { |_| #name() }
    } else {
        quote! { #name }
    };
    let needs =
        needs.map_or_else(|| quote! { ::std::vec::Vec::new }, |needs| quote! { || ::std::vec::Vec::from(#needs) });
    let each = each.map_or_else(
        || quote! { ::core::option::Option::None },
        |each| quote! { ::core::option::Option::Some(|| #each) },
    );
    Ok(quote! {
        ::gaurast_runner::inventory::submit! {
            ::gaurast_runner::Test {
                module: ::core::module_path!(),
                name: ::core::stringify!(#name),
                needs: #needs,
                each: #each,
                alone: #alone,
                run: #run,
            }
        }
    })
}
